/* SPDX-License-Identifier: MIT */
/* Stops the threads in a cycle, where it must not, and where LinuxCNC's motion controller does. */
#include "linuxcnc.h"

static int comp;
static struct {
    volatile int32_t* result;
}* pins;

static void update(void* arg, long period) {
    (void)arg, (void)period;
    *pins->result = hal_stop_threads();
}
int rtapi_app_main(void) {
    comp = hal_init("stopper");
    pins = hal_malloc(sizeof *pins);
    hal_pin_s32_newf(OUT, &pins->result, comp, "stopper.result");
    hal_export_funct("stopper", update, 0, 1, 0, comp);
    return hal_ready(comp);
}
void rtapi_app_exit(void) {
    const int stop = hal_stop_threads();
    const int own = hal_del_funct_from_thread("stopper", "t");

    const int foreign = hal_del_funct_from_thread("other", "t");
    rtapi_print_msg(1, "stopper: %d %d %d\n", stop, own, foreign);
    hal_exit(comp);
}
