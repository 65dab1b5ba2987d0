/* SPDX-License-Identifier: MIT */
/* A component as LinuxCNC hands write it, in two versions (FACTOR), with all kinds of places for a value: pins by pointer and by
 * handle, a parameter by pointer that only the component sets, one that anybody does. Two functions share its pins. */
#include "hal.h"
#include "rtapi.h"
#include "rtapi_app.h"

MODULE_DESCRIPTION("What is measured, times a factor");
MODULE_LICENSE("Dual MIT/GPL");

#ifndef FACTOR
#define FACTOR 10
#endif

static struct gauge {
    hal_float_t *in, *out;
    hal_sint_t cycles;
    hal_u32_t runs;
    hal_float_t gain;
    hal_real_t peak;
}* gauge;
static int component;

static void update(void* arg, long period) {
    struct gauge* const g = arg;
    (void)period;
    *g->out = *g->in * g->gain * FACTOR;
    if (*g->out > hal_get_real(g->peak)) {
        hal_set_real(g->peak, *g->out);
    }
    ++g->runs;
}
static void count(void* arg, long period) {
    struct gauge* const g = arg;
    (void)period;
    hal_set_si32(g->cycles, hal_get_si32(g->cycles) + 1);
}

int rtapi_app_main(void) {
    component = hal_init("gauge");
    if (component < 0) return component;
    gauge = hal_malloc(sizeof *gauge);
    if (!gauge) return -ENOMEM;
    int bad = hal_pin_float_newf(HAL_IN, &gauge->in, component, "gauge.in");
    bad = bad ? bad : hal_pin_float_newf(HAL_OUT, &gauge->out, component, "gauge.out");
    bad = bad ? bad : hal_pin_new_si32(component, HAL_IO, &gauge->cycles, 0, "gauge.cycles");
    bad = bad ? bad : hal_param_u32_newf(HAL_RO, &gauge->runs, component, "gauge.runs");
    bad = bad ? bad : hal_param_float_newf(HAL_RW, &gauge->gain, component, "gauge.gain");
    bad = bad ? bad : hal_param_new_real(component, HAL_RO, &gauge->peak, 0.25, "gauge.peak");
    bad = bad ? bad : hal_export_functf(update, gauge, 1, 0, component, "gauge.update");
    bad = bad ? bad : hal_export_functf(count, gauge, 1, 0, component, "gauge.tally");
    return bad ? bad : hal_ready(component);
}

void rtapi_app_exit(void) { hal_exit(component); }
