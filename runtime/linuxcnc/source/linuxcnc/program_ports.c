/* SPDX-License-Identifier: MIT */
/* hal.h: byte streams (ports) in a program: each call is a request to the machine. */
#include <stdlib.h>
#include <string.h>

#include "inside.h"
#include "program.h"

/* See halcyon_use_port(). */
static bool use_port(hal_port_t port, const char* verb, char* to, const char* from, unsigned count,
                     const char* key, unsigned* number) {
    const locale_t before = halcyon_lock();
    const struct halcyon_link* one = NULL;
    for (const struct halcyon_program* of = halcyon_programs;
         of < halcyon_programs + halcyon_most_programs; ++of) {
        for (size_t i = 0; i < of->link_count; ++i) {
            if ((const volatile void*)of->links[i].pin->slot == (const volatile void*)port) {
                one = &of->links[i];
            }
        }
    }
    const bool done = one && halcyon_use_port(one, verb, to, from, count, key, number);
    halcyon_unlock(before);
    return done;
}

bool hal_port_read(hal_port_t port, char* to, unsigned count) {
    return count > 0 && use_port(port, "read", to, NULL, count, NULL, NULL);
}
bool hal_port_peek(hal_port_t port, char* to, unsigned count) {
    return count > 0 && use_port(port, "peek", to, NULL, count, NULL, NULL);
}
bool hal_port_peek_commit(hal_port_t port, unsigned count) {
    char* const nowhere = malloc(count + 1);
    const bool done = nowhere && hal_port_read(port, nowhere, count);
    free(nowhere);
    return done;
}
bool hal_port_write(hal_port_t port, const char* from, unsigned count) {
    return count > 0 && use_port(port, "write", NULL, from, count, NULL, NULL);
}
static unsigned number_of(hal_port_t port, const char* key) {
    unsigned number = 0;
    use_port(port, "", NULL, NULL, 0, key, &number);
    return number;
}
unsigned hal_port_readable(hal_port_t port) { return number_of(port, "\"readable\":"); }
unsigned hal_port_writable(hal_port_t port) { return number_of(port, "\"writable\":"); }
unsigned hal_port_buffer_size(hal_port_t port) { return number_of(port, "\"size\":"); }
void hal_port_clear(hal_port_t port) { hal_port_peek_commit(port, hal_port_readable(port)); }
