/* SPDX-License-Identifier: MIT */
/*
 * Extension "hal.naming/1", offered while an instance is created: names in the form of LinuxCNC's
 * older components.
 */
#ifndef HAL_NAMING_H
#define HAL_NAMING_H

#include "hal/abi.h"

#ifdef __cplusplus
extern "C" {
#endif

#define HAL_NAMING "hal.naming/1"

typedef struct hal_naming {
    uint32_t size;
    /* Names the instance PREFIX.N, N with at least `digits` digits, unless names= is given. Call it
     * before declaring a pin. [setup] */
    void (*instance)(const hal_host *, const char *prefix, unsigned digits);
    /* Declares that the names of all further functions are complete. [setup] */
    void (*whole_function_names)(const hal_host *);
    /* Sets the number of instances from this argument when neither names= nor count= is given.
     * [setup] */
    void (*count)(const hal_host *, const char *argument, uint64_t instances);
    /* Returns the name of the instance, valid until create returns. Call it after instance().
     * [setup] */
    const char *(*name)(const hal_host *);
} hal_naming;

#ifdef __cplusplus
}
#endif
#endif
