/* SPDX-License-Identifier: MIT */
/*
 * Extension "hal.modules/1", offered while an instance is created: for the library that runs
 * LinuxCNC's compiled modules, each of which it describes as a component with HAL_COMPONENT_MODULE.
 * All [setup], until create returns.
 */
#ifndef HAL_MODULES_H
#define HAL_MODULES_H

#include "hal/abi.h"

#ifdef __cplusplus
extern "C" {
#endif

#define HAL_MODULES "hal.modules/1"

/* A flag of hal_component: create runs code of LinuxCNC's, which may access hardware; the component
 * is loaded once; if it has no function, its pins are used by the functions of all others with this
 * flag. */
enum { HAL_COMPONENT_MODULE = 16 };

typedef struct hal_modules {
    uint32_t size;
    /* Returns the description of the component whose instance is created: all modules share one
     * create function. */
    const hal_component *(*component)(const hal_host *);
    /* Returns false after reporting a given argument that argument() was not asked for; then create
     * must fail. */
    bool (*arguments_known)(const hal_host *);
    /* Requests a thread, which the host adds when create has returned true. A thread of that name
     * and period is used as it is. Returns false if there is one with another period, or the name
     * is requested twice. */
    bool (*thread)(const hal_host *, const char *name, int64_t period_ns);
    /* Gives a pin or parameter that this instance has declared a second name; NULL removes it.
     * Returns false if there is no such pin. */
    bool (*alias)(const hal_host *, const char *name, const char *alias);
    /* Announces memory that the functions of this instance use and that allocate() has not given: a
     * thread fetches it into the caches before its deadline. It may be unmapped once the instance
     * is destroyed. */
    void (*memory)(const hal_host *, const void *begin, size_t bytes);
} hal_modules;

/* Extension "hal.module-calls/1", offered while an instance is created: what LinuxCNC's modules do
 * to the machine as a whole. [setup] unless stated otherwise. */
#define HAL_MODULE_CALLS "hal.module-calls/1"

enum { HAL_MODULE_PIN, HAL_MODULE_PARAMETER, HAL_MODULE_SIGNAL };

typedef struct hal_module_calls {
    uint32_t size;
    /* Carries out a command as part of the transaction that loads the instance: newsig, delsig,
     * linkps, unlinkp, addf, delf, alias, unalias, setp, start, stop, or `lock` and its number. It
     * sees what the instance has declared so far; start, stop and lock take effect with the
     * transaction. Returns 0, or a negative errno (EPERM: locked) after writing why. Until create
     * returns. */
    int (*command)(const hal_host *, const char *const *words, size_t count, char *why, size_t room);
    /* Reads a value as the transaction leaves it, and whether the pin is in a signal or the signal
     * has a writer. Returns false if there is no such object. Until create returns. */
    bool (*value)(const hal_host *, int kind, const char *name, hal_type *type, hal_value *value, bool *linked);
    /* Returns the bits of the locks. Until create returns. */
    unsigned (*locks)(const hal_host *);
    /* Returns the period of the fastest thread, or 0. Until create returns. */
    int64_t (*base_period)(const hal_host *);
    /* States that the instance uses its pins in threads of its own. Returns false on a virtual
     * clock, which these would not follow. Until create returns. */
    bool (*own_threads)(const hal_host *);
    /* Returns the machine, for afterwards(). Until create returns. */
    void *(*machine)(const hal_host *);
    /* Carries out delsig or unlinkp right after the transaction that is about to end, and `failed`
     * if that is rejected. Returns false if there is nothing of that name. Until destroy
     * returns. */
    bool (*afterwards)(void *machine, const char *command, const char *name, void (*failed)(const char *why));
    /* Notes a number that nobody computes, such as a counter of the processor, in the journal of
     * the cycle or setup call that reads it. Returns `value`, or in a re-execution the journaled
     * one. [any] */
    int64_t (*reading)(int64_t value);
} hal_module_calls;

#ifdef __cplusplus
}
#endif
#endif
