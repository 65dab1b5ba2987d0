/* SPDX-License-Identifier: MIT */
/* A stream whose records carry the time at which they were made, and how many were lost before
 * them. */
#ifndef HAL_STREAM_TIMES_H
#define HAL_STREAM_TIMES_H

#include "hal/abi.h"

/* What is published is `stream`, with stream.size = sizeof(hal_timed_stream). */
typedef struct hal_timed_stream {
    hal_stream stream;
    const int64_t*
        times; /* depth entries, hal_cycle.start_ns of each record; written before head is */
    const uint64_t*
        losses; /* depth entries, stream.lost when the record was made; NULL: not known */
} hal_timed_stream;

/* The size of a stream that has times only. */
#define HAL_TIMED_STREAM_SIZE_1 offsetof(hal_timed_stream, losses)

#endif
