/* SPDX-License-Identifier: MIT */
/* Has no function: what follow.c calls uses its pins. */
#include "linuxcnc.h"

static int comp;
static struct {
    volatile double *scale, *last;
}* pins;

__attribute__((visibility("default"))) double planner_next(double now) {
    return *pins->last = now + *pins->scale;
}
int rtapi_app_main(void) {
    comp = hal_init("planner");
    pins = hal_malloc(sizeof *pins);
    hal_pin_float_newf(IN, &pins->scale, comp, "planner.scale");
    hal_pin_float_newf(OUT, &pins->last, comp, "planner.last");
    return hal_ready(comp);
}
void rtapi_app_exit(void) { hal_exit(comp); }
