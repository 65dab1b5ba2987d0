// SPDX-License-Identifier: MIT
component other_name "Declarations that contradict each other and the code";
pin in float x_y; pin in float x-y_;
pin in float if;
pin out bit d if limit > 2;
pin out bit e-#;
function update;
option extra_setup;
;;
FUNCTION(upadte) { }
