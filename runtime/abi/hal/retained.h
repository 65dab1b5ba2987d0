/* SPDX-License-Identifier: MIT */
/*
 * Extension "hal.retained/1", offered while an instance is created: variables that `reload` copies
 * from an instance to the one that replaces it. hal/retained.hpp is what components use.
 */
#ifndef HAL_RETAINED_H
#define HAL_RETAINED_H

#include "hal/abi.h"

#ifdef __cplusplus
extern "C" {
#endif

#define HAL_RETAINED "hal.retained/1"

typedef struct hal_variable {
    uint32_t size;
    uint32_t pad;
    const char *name; /* copied by the host; the n-th variable of a name replaces the n-th of that name */
    uint64_t type;    /* a variable is copied to one of the same name, type and number of bytes only; the plugin chooses the numbers */
    void *memory;     /* stays where it is as long as the instance lives; contains no pointer */
    uint64_t bytes;
} hal_variable;

typedef struct hal_retained {
    uint32_t size;
    uint32_t pad;
    /* Declares a variable. The host copies it before the first cycle of the new instance and after
     * the last one of the old instance, in the thread that runs them or while no thread does.
     * false: create must fail. [setup] */
    bool (*declare)(const hal_host *, const hal_variable *);
} hal_retained;

#ifdef __cplusplus
}
#endif
#endif
