/* SPDX-License-Identifier: MIT */
/* out = in * gain (a pin with a default), counted in a parameter by pointer; the number of instances is that of count= or names=. */
#include "linuxcnc.h"
#include <string.h>

static int count = 1, comp;
static long offset = 0;
static char* names = "";
static int steps[4] = {1, 1, 1, 1};
PARAMETER(count, "i", "number of instances")
PARAMETER(offset, "l", "added to every output")
PARAMETER(names, "s", "names of the instances")
ARRAY(steps, "i", 4, "counted per cycle")
DESCRIPTION("Multiplies")
const char* rtapi_info_linuxcnc_7 = "pin:in:the input";

struct gain {
    volatile double *in, *out, *gain;
    volatile bool* threaded;
    volatile int32_t cycles, limit;
    int step;
};

static void update(void* arg, long period) {
    struct gain* const g = arg;
    (void)period;
    *g->out = *g->in * *g->gain + (double)offset;
    *g->threaded = rtapi_task_self() >= 0;
    g->cycles += g->step;
    if (g->cycles > g->limit) {
        g->cycles = 0;
    }
}

int rtapi_app_main(void) {
    if (*names && count != 1) {
        rtapi_print_msg(1, "count= and names= are mutually exclusive\n");
        comp = hal_init("gain"); /* and stays there: a host must clean up */
        return -22;
    }
    comp = hal_init("gain");
    if (comp < 0) return comp;
    for (int i = 0; i < count; ++i) {
        char name[40];
        rtapi_snprintf(name, sizeof name, *names ? "%s" : "gain.%s%d", *names ? names : "", i);
        struct gain* const g = hal_malloc(sizeof *g);
        if (!g || g->in) return -12;
        if (hal_pin_float_newf(IN, &g->in, comp, "%s.in", name) ||
            hal_pin_float_newf(OUT, &g->out, comp, "%s.out", name)) {
            return -1;
        }
        if (hal_pin_float_newf(IN, &g->gain, comp, "%s.gain", name) ||
            hal_pin_bit_newf(OUT, &g->threaded, comp, "%s.threaded", name)) {
            return -1;
        }
        if (hal_param_s32_newf(RO, &g->cycles, comp, "%s.cycles", name) ||
            hal_param_s32_newf(RW, &g->limit, comp, "%s.limit", name)) {
            return -1;
        }
        const int level = rtapi_get_msg_level();
        rtapi_set_msg_level(0);
        if (hal_pin_float_newf(IN, &g->in, comp, "%s.in", name) != -22 || hal_init("gain") != -22) {
            return -2; /* duplicates */
        }
        rtapi_set_msg_level(level);
        *g->gain = 2.0;
        g->limit = 1000;
        g->step = steps[i % 4];
        if (hal_export_funct(name, update, g, 1, 0, comp)) return -3;
    }
    if (rtapi_task_self() >= 0) return -4;
    return hal_ready(comp);
}
void rtapi_app_exit(void) { hal_exit(comp); }
