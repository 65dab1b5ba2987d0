component logic_demo "Logic of several inputs";
pin in bit in-##[16 : personality & 0xff] "the inputs";
pin out bit and if personality & 0x100 "all of them";
pin out bool or if personality & 0x200;
pin io s32 count = 3 "how often";
pin out real level.value = 1.5;
param rw float gain = 2.5 "gain of # nothing";
param r unsigned calls;
variable double old = 7;
variable int history[4] = 1;
option extra_setup;
function _ nofp "does it";
function second-one;
modparam int limit = 4 "limit of it";
description """
Adds.
.IP \\(bu 4
One \\fBbold\\fR
""";
license "GPL"; author "Me";
;;
EXTRA_SETUP() { (void)prefix; (void)extra_arg; if (personality < 0) return -EINVAL; return 0; }
FUNCTION(_) {
    int i, a = 1, o = 0;
    for (i = 0; i < (personality & 0xff); i++) { if (in(i)) o = 1; else a = 0; }
    and = a; or_set(o); calls++; count += limit; level_value_set(level_value * gain * fperiod); history[2]++;
}
FUNCTION(second_one) { old = period; }
