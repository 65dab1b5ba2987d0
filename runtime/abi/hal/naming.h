/* SPDX-License-Identifier: MIT */
/*
 * Extension "hal.naming/1", offered while an instance is created: names as LinuxCNC's older components make them.
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
    /* Before the first pin and function: without names= the instance is PREFIX.N, N with at least so many digits. [setup] */
    void (*instance)(const hal_host *, const char *prefix, unsigned digits);
    /* From here on a function's name is all of its name. [setup] */
    void (*whole_function_names)(const hal_host *);
    /* This argument says how many instances there are when neither names= nor count= does. [setup] */
    void (*count)(const hal_host *, const char *argument, uint64_t instances);
    /* The instance's name, valid until create returns. Ask after instance(). [setup] */
    const char *(*name)(const hal_host *);
} hal_naming;

#ifdef __cplusplus
}
#endif
#endif
