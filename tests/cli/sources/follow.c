/* SPDX-License-Identifier: MIT */
/* A program as LinuxCNC hands write it, in its own process: pins by pointer and by handle, parameters of both kinds. */
#include <unistd.h>

#include "hal.h"
#include "rtapi.h"

static struct follow {
    hal_float_t *in, *out;
    hal_sint_t inside;
    hal_float_t gain;
    hal_s32_t seen;
}* follow;

int main(void) {
    const int component = hal_init("follow");
    if (component < 0) return 1;
    follow = hal_malloc(sizeof *follow);
    if (!follow || hal_pin_float_newf(HAL_IN, &follow->in, component, "follow.in") ||
        hal_pin_float_newf(HAL_OUT, &follow->out, component, "follow.out") ||
        hal_pin_new_si32(component, HAL_IO, &follow->inside, -3, "follow.inside") ||
        hal_param_float_newf(HAL_RW, &follow->gain, component, "follow.gain") ||
        hal_param_s32_newf(HAL_RO, &follow->seen, component, "follow.seen")) {
        hal_exit(component);
        return 1;
    }
    follow->gain = 2;
    hal_ready(component);
    for (;;) {
        *follow->out = *follow->in * follow->gain;
        follow->seen = hal_get_si32(follow->inside);
        if (follow->seen > 50) {
            hal_set_si32(follow->inside, 0);
        }
        usleep(1000);
    }
}
