component mistakes "open text
pin inn float a;
pin in flot b;
pin in float c[0;
pin out bit d-# [4 : personality * ] if
param w bit e;
pin in bit x_y; pin in bit x-y_; pin in float if;
variable unsigned long f;
optoin singleton;
option singleton yes "no" ;
include <no;
modparam char g;
function h fp """never ended
;;
FUNCTION(i) { }
