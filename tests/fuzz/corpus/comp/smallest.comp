component smallest;
pin in float in;
pin out float out_;
function _;
license "MIT";
;;
out_ = in;
