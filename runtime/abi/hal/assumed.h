/* SPDX-License-Identifier: MIT */
/*
 * Extension "hal.assumed/1", offered while an instance is created: names that `hal check --assume`
 * takes to exist.
 */
#ifndef HAL_ASSUMED_H
#define HAL_ASSUMED_H

#include "hal/abi.h"

#ifdef __cplusplus
extern "C" {
#endif

#define HAL_ASSUMED "hal.assumed/1"

typedef struct hal_assumed {
    uint32_t size;
    /* Returns whether a component, or the beginning of names, is assumed to exist. [setup] */
    bool (*is_assumed)(const hal_host *, const char *name);
} hal_assumed;

#ifdef __cplusplus
}
#endif
#endif
