/* SPDX-License-Identifier: MIT */
/* hal.h: byte streams (ports) in a plugin; program_ports.c has those of a program. */
#include "inside.h"

static hal_port* port_of(hal_port_t handle) { return handle ? handle->value : NULL; }
static uint64_t held_by(const hal_port* port) {
    return __atomic_load_n(&port->head, __ATOMIC_ACQUIRE) -
           __atomic_load_n(&port->tail, __ATOMIC_ACQUIRE);
}

unsigned hal_port_buffer_size(hal_port_t handle) {
    return port_of(handle) ? port_of(handle)->capacity : 0;
}
unsigned hal_port_readable(hal_port_t handle) {
    return port_of(handle) ? (unsigned)held_by(port_of(handle)) : 0;
}
unsigned hal_port_writable(hal_port_t handle) {
    return hal_port_buffer_size(handle) - hal_port_readable(handle);
}
bool hal_port_peek(hal_port_t handle, char* to, unsigned count) {
    if (count == 0 || hal_port_readable(handle) < count) return false;
    const hal_port* const port = port_of(handle);
    for (unsigned i = 0; i < count; ++i) {
        to[i] = (char)port->data[(port->tail + i) % port->capacity];
    }
    return true;
}
bool hal_port_peek_commit(hal_port_t handle, unsigned count) {
    if (hal_port_readable(handle) < count || !port_of(handle)) return false;
    __atomic_store_n(&port_of(handle)->tail, port_of(handle)->tail + count, __ATOMIC_RELEASE);
    return true;
}
bool hal_port_read(hal_port_t handle, char* to, unsigned count) {
    return hal_port_peek(handle, to, count) && hal_port_peek_commit(handle, count);
}
void hal_port_clear(hal_port_t handle) { hal_port_peek_commit(handle, hal_port_readable(handle)); }
bool hal_port_write(hal_port_t handle, const char* from, unsigned count) {
    if (count == 0 || hal_port_writable(handle) < count) return false;
    hal_port* const port = port_of(handle);
    for (unsigned i = 0; i < count; ++i) {
        port->data[(port->head + i) % port->capacity] = (uint8_t)from[i];
    }
    __atomic_store_n(&port->head, port->head + count, __ATOMIC_RELEASE);
    return true;
}
