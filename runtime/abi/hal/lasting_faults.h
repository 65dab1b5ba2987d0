/* SPDX-License-Identifier: MIT */
/* Faults whose condition lasts. The host offers one record under both ids: faults.size of
 * "hal.faults/1" shows whether it is this struct. */
#ifndef HAL_LASTING_FAULTS_H
#define HAL_LASTING_FAULTS_H

#include "hal/abi.h"
#define HAL_LASTING_FAULTS "hal.lasting-faults/1"

typedef struct hal_lasting_faults {
    hal_faults faults;
    uint64_t lasting; /* conditions that last now; written by the host, read atomically [any] */
    /* [realtime] The condition that `self` raises with the same `reason` begins (call it before
       raise) or is over. While it lasts, `clear` does not acknowledge its newest fault. The host
       ends the conditions of an instance that is stopped. */
    void (*lasts)(const hal_faults *, const void *self, const char *reason, bool lasts);
} hal_lasting_faults;

#endif
