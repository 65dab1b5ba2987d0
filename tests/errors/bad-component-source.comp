// SPDX-License-Identifier: MIT
component bad_component_source "Mistakes in the declarations"
pin inn float a;
pin in flot b;
pin in float c-#[0];
pin in float x_y; pin in float x-y_;
pin in bit d if limit > 2;
function update;
optoin singleton;
;;
FUNCTION(upadte) { }
