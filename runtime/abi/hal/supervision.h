/* SPDX-License-Identifier: MIT */
/* The supervisor of the threads, for components that feed a watchdog: offered in start(). */
#ifndef HAL_SUPERVISION_H
#define HAL_SUPERVISION_H

#include <stdint.h>

#define HAL_SUPERVISION "hal.supervision/1"

typedef struct hal_supervision {
    uint32_t size;
    uint32_t pad;
    uint64_t progress; /* grows each time the supervisor finds that every supervised thread has ended a cycle within its limit; written by
                          the host, read atomically [any] */
} hal_supervision;

#endif
