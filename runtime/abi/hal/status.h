/* SPDX-License-Identifier: MIT */
/* The state of an instance as text, for a component that publishes it. Offered in start(). */
#ifndef HAL_STATUS_H
#define HAL_STATUS_H

#include <stddef.h>

#define HAL_STATUS "hal.status/1"

typedef struct hal_status {
    size_t size; /* of this struct */
    /* Lines "KEY VALUE": instance, host, pid, running, thread (NAME PERIOD-NS CYCLES MISSED
     * FAULTED), faults, fault (newest, a sentence). Returns its length, at most `room`; 0: the
     * machine is being edited, ask again later. Does not wait. From start() until stop() returns.
     * [any but a cycle] */
    size_t (*text)(const struct hal_status *self, char *to, size_t room);
    void *data; /* the host's */
} hal_status;

#endif
