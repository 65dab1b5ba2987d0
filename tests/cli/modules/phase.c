/* SPDX-License-Identifier: MIT */
/* Adjusts the period of the thread that calls it, and shows what it is. */
#include "linuxcnc.h"

static int comp;
static struct {
    volatile int32_t *correction, *result, *period;
    volatile bool* set;
}* own;

static void update(void* arg, long period) {
    static long long before;
    (void)arg, (void)period;
    const long long now = rtapi_task_pll_get_reference();
    *own->period = (int32_t)(now - before);
    before = now;
    if (*own->set) {
        *own->result = rtapi_task_pll_set_correction(*own->correction);
    }
}
int rtapi_app_main(void) {
    comp = hal_init("phase");
    own = hal_malloc(sizeof *own);
    hal_pin_s32_newf(IN, &own->correction, comp, "phase.correction");
    hal_pin_s32_newf(OUT, &own->result, comp, "phase.result");
    hal_pin_s32_newf(OUT, &own->period, comp, "phase.period");
    hal_pin_bit_newf(IN, &own->set, comp, "phase.set");
    hal_export_funct("phase", update, 0, 1, 0, comp);
    const long before = rtapi_clock_set_period(0);
    const long set = rtapi_clock_set_period(400000);

    const long again = rtapi_clock_set_period(500000);
    const long now = rtapi_clock_set_period(0);
    rtapi_print_msg(1, "phase: %d, %ld %ld %ld %ld\n", rtapi_task_pll_set_correction(1), before,
                    set, again, now);
    hal_create_thread("phase-thread", 1100000, 1); /* a multiple of that: 1200000 */
    return hal_ready(comp);
}
void rtapi_app_exit(void) { hal_exit(comp); }
