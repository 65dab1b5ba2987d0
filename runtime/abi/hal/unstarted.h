/* SPDX-License-Identifier: MIT */
/*
 * Extension "hal.unstarted/1", offered while an instance is created: the programs of `loadusr` that
 * `hal check` does not start.
 */
#ifndef HAL_UNSTARTED_H
#define HAL_UNSTARTED_H

#include "hal/abi.h"

#ifdef __cplusplus
extern "C" {
#endif

#define HAL_UNSTARTED "hal.unstarted/1"

typedef struct hal_unstarted {
    uint32_t size;
    /* Returns the first argument behind the options of the last program of this name; NULL
       without such an argument. The text stays until the instance is created. [setup] */
    const char *(*argument)(const hal_host *, const char *program);
} hal_unstarted;

#ifdef __cplusplus
}
#endif
#endif
