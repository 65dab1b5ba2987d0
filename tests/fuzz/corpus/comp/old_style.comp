component hal_old_style r"raw \fBtext\fR";
pin io unsigned x.##.y [3] = 0x10 "number"; // comment
param rw signed min_ = -3; /* and
another */
pin in port p;
option data inside;
option count_function; option default_count 3;
option extra_cleanup yes;
function do-it nofp;
include "mine.h";
author "A"; author "B";
examples r"""
.nf
loadrt x
.fi
.TP
.B word
meaning""";
license "GPL";
;;
typedef struct { int a; } inside;
int get_count(void) { return 2; }
EXTRA_CLEANUP() { FOR_ALL_INSTS() data.a = min_; }
FUNCTION(do_it) { data.a += x_y(2); }
