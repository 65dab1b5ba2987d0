/* SPDX-License-Identifier: MIT */
/* A program as LinuxCNC's are: two components, pins of every type, and afterwards nothing but loads and stores. */
#include "declared.h"

struct pins {
    volatile bool *on, *seen;
    volatile double *in, *twice;
    volatile int32_t* count;
    volatile uint32_t* steps;
    volatile double gain;
};

int main(void) {
    const int helper = hal_init("gauge-helper");
    const int comp = hal_init("gauge");
    if (helper <= 0 || comp <= 0 || helper == comp || hal_ready(helper) != 0) return 1;
    struct pins* const pins = hal_malloc(sizeof *pins);
    if (hal_pin_bit_new("gauge.on", HAL_IN, &pins->on, comp) ||
        hal_pin_bit_newf(HAL_OUT, &pins->seen, comp, "gauge.%s", "seen") ||
        hal_pin_float_newf(HAL_IN, &pins->in, comp, "gauge.%d.in", 0) ||
        hal_pin_float_newf(HAL_OUT, &pins->twice, comp, "gauge.%d.twice", 0) ||
        hal_pin_s32_newf(HAL_IO, &pins->count, comp, "gauge.count") ||
        hal_pin_u32_newf(HAL_OUT, &pins->steps, comp, "gauge.steps")) {
        return 2;
    }
    pins->gain = 2;
    *pins->count = -7; /* a default, before ready */
    if (hal_param_float_newf(HAL_RW, &pins->gain, comp, "gauge.gain")) return 3;
    if (hal_pin_bit_new("gauge.on", HAL_IN, &pins->on, comp) >= 0) {
        return 4; /* a duplicate */
    }
    if (hal_ready(comp) != 0) return 5;
    for (;;) {
        *pins->seen = *pins->on;
        *pins->twice = *pins->in * pins->gain;
        ++*pins->steps;
        usleep(1000);
    }
}
