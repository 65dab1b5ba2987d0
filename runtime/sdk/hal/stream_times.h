/* SPDX-License-Identifier: MIT */
/* A stream whose records carry the time at which they were made. */
#ifndef HAL_STREAM_TIMES_H
#define HAL_STREAM_TIMES_H

#include "hal/abi.h"

/* What is published is `stream`, with stream.size = sizeof(hal_timed_stream). */
typedef struct hal_timed_stream {
    hal_stream stream;
    const int64_t *times; /* depth entries, hal_cycle.start_ns of each record; written before head is */
} hal_timed_stream;

#endif
