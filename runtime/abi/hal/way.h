/* SPDX-License-Identifier: MIT */
/*
 * Extension "hal.way/1", offered while an instance is started: how long values of its pins are on their way to or from another machine.
 * hal/way.hpp is what components use; `show latency` prints it.
 */
#ifndef HAL_WAY_H
#define HAL_WAY_H

#include "hal/abi.h"

#ifdef __cplusplus
extern "C" {
#endif

#define HAL_WAY "hal.way/1"

typedef struct hal_way {
    uint32_t size;
    /* In start: the value of an IN pin goes on to `far`, that of an OUT pin comes from there. `pin` is its name below the instance's.
     * `cycles`: of this instance's thread, begun between the one in which it is here and the one in which it is there. `round_trip`: cycles
     * until an input over there that follows this value is here; 0: not known. `worst_ns`: of the way, and of an input that changed just
     * after it was read. Texts are copied. False: no memory. [setup] */
    bool (*tell)(const struct hal_way *, const hal_host *, const char *pin, const char *far, uint32_t cycles, uint32_t round_trip,
                 int64_t worst_ns);
} hal_way;

#ifdef __cplusplus
}
#endif
#endif
