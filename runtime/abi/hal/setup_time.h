/* SPDX-License-Identifier: MIT */
/*
 * Extension "hal.setup-time/1", offered while an instance is started: how long a call of start or
 * stop may take. The host reports a call that lasts longer than 2 s as one that does not return;
 * hal/setup_time.hpp is what components use.
 */
#ifndef HAL_SETUP_TIME_H
#define HAL_SETUP_TIME_H

#include "hal/abi.h"

#ifdef __cplusplus
extern "C" {
#endif

#define HAL_SETUP_TIME "hal.setup-time/1"

typedef struct hal_setup_time {
    uint32_t size;
    uint32_t pad;
    /* In start or stop: this call may take `ns` from its beginning, 60 s at most. `why` completes
     * "NAME needs up to 5 s to stop: " and lives as long as the plugin. [setup] */
    void (*expect)(const struct hal_setup_time *, int64_t ns, const char *why);
} hal_setup_time;

#ifdef __cplusplus
}
#endif
#endif
