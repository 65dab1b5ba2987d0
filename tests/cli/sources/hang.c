/* SPDX-License-Identifier: MIT */
/* A program that declares a rate and a safe value of its output, and hangs on request. */
#include <unistd.h>

#include "hal.h"

static struct hang {
    hal_float_t* out;
    hal_bit_t* loop;
}* hang;

int main(void) {
    const int component = hal_init("hang");
    if (component < 0) return 1;
    hang = hal_malloc(sizeof *hang);
    if (!hang || hal_pin_float_newf(HAL_OUT, &hang->out, component, "hang.out") ||
        hal_pin_bit_newf(HAL_IN, &hang->loop, component, "hang.loop") ||
        halcyon_safe(component, "hang.out", -2) || halcyon_every(component, 100, 100)) {
        hal_exit(component);
        return 1;
    }
    hal_ready(component);
    for (;;) {
        halcyon_alive(component);
        *hang->out = 5;
        while (*hang->loop) {
            *hang->out = *hang->out + 1;
        }
        usleep(1000);
    }
}
