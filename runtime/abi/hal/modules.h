/* SPDX-License-Identifier: MIT */
/*
 * Extension "hal.modules/1", offered while an instance is created: for the library that runs LinuxCNC's compiled modules, each of which
 * it describes as a component with HAL_COMPONENT_MODULE. All [setup], until create returns.
 */
#ifndef HAL_MODULES_H
#define HAL_MODULES_H

#include "hal/abi.h"

#ifdef __cplusplus
extern "C" {
#endif

#define HAL_MODULES "hal.modules/1"

/* A flag of hal_component: create runs code of LinuxCNC's, which may access hardware; the component is loaded once; if it has no function,
 * its pins are used by the functions of all others with this flag. */
enum { HAL_COMPONENT_MODULE = 16 };

typedef struct hal_modules {
    uint32_t size;
    /* Returns the description of the component whose instance is created: all modules share one create function. */
    const hal_component *(*component)(const hal_host *);
    /* Returns false after reporting a given argument that argument() was not asked for; then create must fail. */
    bool (*arguments_known)(const hal_host *);
    /* Requests a thread, which the host adds when create has returned true. A thread of that name and
     * period is used as it is. Returns false if there is one with another period, or the name is requested twice. */
    bool (*thread)(const hal_host *, const char *name, int64_t period_ns);
    /* Gives a pin or parameter that this instance has declared a second name; NULL removes it. Returns false if there is no such pin. */
    bool (*alias)(const hal_host *, const char *name, const char *alias);
    /* Announces memory that the functions of this instance use and that allocate() has not given: a thread fetches it into the caches
     * before its deadline. It may be unmapped once the instance is destroyed. */
    void (*memory)(const hal_host *, const void *begin, size_t bytes);
} hal_modules;

#ifdef __cplusplus
}
#endif
#endif
