/* SPDX-License-Identifier: MIT */
/* hal.h: streams of records between a component and a program. */
#include <stdio.h>
#include <string.h>

#include "inside.h"

struct halcyon_stream {
    hal_stream fifo;
    char name[16];
    uint64_t number; /* of the next record */
    struct halcyon_stream* next;
};
static struct halcyon_stream* streams;

enum { sampler_key = 0x48534130, streamer_key = 0x48535430 };

int hal_stream_create(hal_stream_t* stream, int comp, int key, unsigned depth, const char* types) {
    (void)comp;
    const hal_host* const host = halcyon_current_host;
    const size_t columns = types ? strlen(types) : 0;
    if (!host || columns == 0 || columns > HAL_STREAM_MAX_PINS || depth == 0 ||
        depth > (1u << 26)) {
        return -EINVAL;
    }
    for (size_t i = 0; i < columns; ++i) {
        if (!strchr("bBfFsSuUlLkK", types[i])) return -EINVAL;
    }
    struct halcyon_stream* const made =
        host->allocate(host, sizeof *made, _Alignof(struct halcyon_stream));
    char* const letters = host->allocate(host, columns + 1, 1);
    hal_value* const data =
        host->allocate(host, (size_t)depth * (columns + 1) * sizeof *data, _Alignof(hal_value));
    if (!made || !letters || !data) return -ENOMEM;
    for (size_t i = 0; i < columns; ++i) {
        letters[i] = (char)(types[i] | 0x20);
    }
    const bool to_machine = (key & ~0xf) == streamer_key;
    made->fifo = (hal_stream){.size = sizeof made->fifo,
                              .columns = (uint32_t)columns,
                              .depth = depth,
                              .to_machine = to_machine,
                              .types = letters,
                              .data = data};
    snprintf(made->name, sizeof made->name, "%d", key - (to_machine ? streamer_key : sampler_key));
    made->next = streams;
    streams = made;
    stream->fifo = made;
    return 0;
}
void hal_stream_destroy(hal_stream_t* stream) { stream->fifo = NULL; }
int hal_stream_attach(hal_stream_t* stream, int comp, int key, const char* types) {
    (void)stream, (void)comp, (void)key, (void)types;
    return -ENOENT;
}
int hal_stream_detach(hal_stream_t* stream) {
    stream->fifo = NULL;
    return 0;
}

static uint64_t waiting_in(const hal_stream* fifo) {
    return __atomic_load_n(&fifo->head, __ATOMIC_ACQUIRE) -
           __atomic_load_n(&fifo->tail, __ATOMIC_ACQUIRE);
}
static hal_value* record_of(const hal_stream* fifo, uint64_t number) {
    return fifo->data + number % fifo->depth * (fifo->columns + 1);
}

int hal_stream_element_count(hal_stream_t* stream) { return (int)stream->fifo->fifo.columns; }
hal_type_t hal_stream_element_type(hal_stream_t* stream, int index) {
    static const char letters[] = "bfsulk";
    static const hal_type_t types[] = {HAL_BOOL, HAL_REAL, HAL_S32, HAL_U32, HAL_S64, HAL_U64};
    return types[strchr(letters, stream->fifo->fifo.types[index]) - letters];
}
bool hal_stream_readable(hal_stream_t* stream) { return waiting_in(&stream->fifo->fifo) > 0; }
bool hal_stream_writable(hal_stream_t* stream) {
    return waiting_in(&stream->fifo->fifo) < stream->fifo->fifo.depth;
}
int hal_stream_depth(hal_stream_t* stream) { return (int)waiting_in(&stream->fifo->fifo); }
int hal_stream_maxdepth(hal_stream_t* stream) { return (int)stream->fifo->fifo.depth; }
static int lost_of(const hal_stream_t* stream, uint32_t to_machine) {
    const hal_stream* const fifo = &stream->fifo->fifo;
    return fifo->to_machine == to_machine ? (int)__atomic_load_n(&fifo->lost, __ATOMIC_RELAXED) : 0;
}
int hal_stream_num_underruns(hal_stream_t* stream) { return lost_of(stream, 1); }
int hal_stream_num_overruns(hal_stream_t* stream) { return lost_of(stream, 0); }

int hal_stream_read(hal_stream_t* stream, hal_stream_data_u* to, unsigned* number) {
    hal_stream* const fifo = &stream->fifo->fifo;
    if (!hal_stream_readable(stream)) {
        __atomic_store_n(&fifo->lost, fifo->lost + 1, __ATOMIC_RELAXED);
        return -EAGAIN;
    }
    const hal_value* const record = record_of(fifo, fifo->tail);
    memcpy(to, record, fifo->columns * sizeof *record);
    if (number) {
        *number = record[fifo->columns].u32;
    }
    __atomic_store_n(&fifo->tail, fifo->tail + 1, __ATOMIC_RELEASE);
    return 0;
}
int hal_stream_write(hal_stream_t* stream, hal_stream_data_u* from) {
    hal_stream* const fifo = &stream->fifo->fifo;
    const uint64_t number = stream->fifo->number++;
    if (!hal_stream_writable(stream)) {
        __atomic_store_n(&fifo->lost, fifo->lost + 1, __ATOMIC_RELAXED);
        return -ENOSPC;
    }
    hal_value* const record = record_of(fifo, fifo->head);
    memcpy(record, from, fifo->columns * sizeof *record);
    record[fifo->columns].raw = number;
    __atomic_store_n(&fifo->head, fifo->head + 1, __ATOMIC_RELEASE);
    return 0;
}

bool halcyon_publish_streams(const hal_host* of) {
    const hal_stream_host* const outside = streams ? of->extension(of, "hal.stream/1") : NULL;
    for (struct halcyon_stream* one = streams; outside && one; one = one->next) {
        if (!outside->publish(of, one->name, &one->fifo)) return false;
    }
    return true;
}
