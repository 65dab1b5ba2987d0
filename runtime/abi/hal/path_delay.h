/* SPDX-License-Identifier: MIT */
/*
 * Extension "hal.path_delay/1", offered while an instance is started: the delay of its pins' values
 * on their path to or from another machine. Components use hal/path_delay.hpp; `show latency`
 * prints it.
 */
#ifndef HAL_PATH_DELAY_H
#define HAL_PATH_DELAY_H

#include "hal/abi.h"

#ifdef __cplusplus
extern "C" {
#endif

#define HAL_PATH_DELAY "hal.path_delay/1"

typedef struct hal_path_delay {
    uint32_t size;
    /* Reports, in start, that the value of an IN pin is sent to `far`, or that of an OUT pin
     * received from there. `pin` is its name below the instance's. `cycles`: cycles of this
     * instance's thread from the one that sends the value to the one that receives it.
     * `round_trip`: cycles until an input at the far end that follows this value is received here;
     * 0: unknown. `worst_ns`: the longest delay, of an input that changed just after it was read.
     * Texts are copied. Returns false when out of memory. [setup] */
    bool (*report)(const struct hal_path_delay *, const hal_host *, const char *pin, const char *far, uint32_t cycles, uint32_t round_trip,
                 int64_t worst_ns);
} hal_path_delay;

#ifdef __cplusplus
}
#endif
#endif
