/* SPDX-License-Identifier: MIT */
/* The journal of the machine, for instances that report what happened in sentences; recordings and
 * traces contain it. Offered in start(). */
#ifndef HAL_MESSAGES_H
#define HAL_MESSAGES_H

#include <stddef.h>

#define HAL_MESSAGES "hal.messages/1"

typedef struct hal_messages {
    size_t size; /* of this struct */
    /* Adds a line without its newline, which is copied; does nothing while nobody records. Waits
     * for other callers only. From start() until stop() returns. [any but a cycle] */
    void (*add)(const struct hal_messages *self, const char *line, size_t bytes);
    void *data; /* the host's */
} hal_messages;

#endif
