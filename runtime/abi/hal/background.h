/* SPDX-License-Identifier: MIT */
/*
 * Extension "hal.background/1", offered while an instance is started: work that is not real time
 * and yet comes out the same in every run on the virtual clock. hal/background.hpp is what
 * components use.
 */
#ifndef HAL_BACKGROUND_H
#define HAL_BACKGROUND_H

#include "hal/abi.h"

#ifdef __cplusplus
extern "C" {
#endif

#define HAL_BACKGROUND "hal.background/1"

typedef struct hal_background {
    uint32_t size;
    uint32_t is_virtual; /* 1: cycles run on a virtual clock; 0: on the real one, where work that is not real time has a thread of its own */
    /* Virtual clock: after the last cycle of each instant the host calls `work` with that instant,
     * outside of all cycles: it may allocate, lock and block, and the clock waits for it. In the
     * order of attaching. False: nothing is done, because the clock is real or there is no memory.
     * [setup] */
    bool (*attach)(const struct hal_background *, void (*work)(void *self, int64_t now_ns), void *self);
    /* `work` of this `self` is not called any more. In stop, if attach gave true. [setup] */
    void (*detach)(const struct hal_background *, void *self);
} hal_background;

#ifdef __cplusplus
}
#endif
#endif
