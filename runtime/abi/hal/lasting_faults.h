/* SPDX-License-Identifier: MIT */
/* Faults whose condition lasts: what extension "hal.faults/1" offers behind its first members. */
#ifndef HAL_LASTING_FAULTS_H
#define HAL_LASTING_FAULTS_H

#include "hal/abi.h"

/* A host that is older offers a hal_faults only: then faults.size is smaller. */
typedef struct hal_lasting_faults {
    hal_faults faults;
    uint64_t lasting; /* conditions that last now; written by the host, read atomically [any] */
    /* [realtime] The condition that `self` raises with the same `reason` begins (call it before raise) or is over. While it lasts, `clear`
       does not acknowledge its newest fault. The host ends the conditions of an instance that is stopped. */
    void (*lasts)(const hal_faults *, const void *self, const char *reason, bool lasts);
} hal_lasting_faults;

#endif
