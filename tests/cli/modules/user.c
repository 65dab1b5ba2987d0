/* SPDX-License-Identifier: MIT */
/* Needs planner.c, as a second module that does. */
#include "linuxcnc.h"

double planner_next(double now);

static int comp;
int rtapi_app_main(void) {
    comp = hal_init("user");
    if (planner_next(0) != 0) return -1;
    return hal_ready(comp);
}
void rtapi_app_exit(void) { hal_exit(comp); }
