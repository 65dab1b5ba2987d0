/* SPDX-License-Identifier: MIT */
/* Crashes, fails or prints at the place in fault=. */
#include "linuxcnc.h"
#include <stdlib.h>

static char* fault = "";
static int comp;
PARAMETER(fault, "s", "main, fail, exit, cycle or talk")
static volatile double** out;
static bool is(char letter) { return fault[0] == letter; }

static void crash(void) { *(volatile int*)8 = 1; }
static void update(void* arg, long period) {
    static int n;
    (void)arg, (void)period;
    **out = ++n;
    if (is('c') && n == 3) {
        crash();
    }
    if (is('t')) {
        rtapi_print_msg(1, "troubled: message %d\n", n);
    }
}
int rtapi_app_main(void) {
    comp = hal_init("troubled");
    if (is('m')) {
        crash();
    }
    if (is('f')) {
        rtapi_print("troubled: begins\n");
        rtapi_print_msg(1, "troubled: loading a driver without a card\n");
        rtapi_print_msg(1, "troubled: no card\n");
        rtapi_print_msg(1, "troubled: giving up\n");
        rtapi_print_msg(4, "troubled: never printed\n");
        return -19;
    }
    out = hal_malloc(sizeof *out);
    hal_pin_new("troubled.out", FLOAT, OUT, (void**)out, comp);
    hal_export_funct("troubled", update, 0, 1, 0, comp);
    rtapi_print("troubled: hello\n");
    return hal_ready(comp);
}
void rtapi_app_exit(void) {
    if (is('e')) {
        crash();
    }
    hal_exit(comp);
}
