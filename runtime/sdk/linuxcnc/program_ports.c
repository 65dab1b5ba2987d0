/* SPDX-License-Identifier: MIT */
/* hal.h: byte streams (ports) in a program: each call is a request to the machine. */
#include <stdlib.h>
#include <string.h>

#include "inside.h"
#include "program.h"

static unsigned number_in(const char *answer, const char *key) {
    const char *const at = answer ? strstr(answer, key) : NULL;
    return at ? (unsigned)strtoul(at + strlen(key), NULL, 10) : 0;
}

/* Reads, peeks (verb) or writes count bytes. Returns true when all were transferred; sets number to the value of the reply's key. */
static bool use_port(hal_port_t port, const char *verb, char *to, const char *from, unsigned count, const char *key, unsigned *number) {
    const locale_t before = halcyon_lock();
    const struct halcyon_link *one = NULL;
    for (const struct halcyon_program *of = halcyon_programs; of < halcyon_programs + halcyon_most_programs; ++of)
        for (size_t i = 0; i < of->link_count; ++i)
            if ((const volatile void *)of->links[i].pin->slot == (const volatile void *)port) one = &of->links[i];
    bool done = false;
    if (one && halcyon_connection >= 0) {
        halcyon_add("{\"port\":\"%s.%s\"", one->prefix, one->name);
        if (to) halcyon_add(",\"%s\":%u", verb, count);
        if (from) halcyon_add(",\"write\":\"");
        for (unsigned i = 0; from && i < count; ++i) halcyon_add("%02x", (unsigned char)from[i]);
        halcyon_add(from ? "\"}" : "}");
        const char *const answer = halcyon_ask(), *bytes = answer ? strstr(answer, "\"bytes\":\"") : NULL;
        done = answer && strstr(answer, "\"done\":true");
        for (unsigned i = 0; done && to && bytes && i < count; ++i) {
            const char pair[3] = {bytes[9 + 2 * i], bytes[10 + 2 * i], '\0'};
            to[i] = (char)strtoul(pair, NULL, 16);
        }
        if (key) *number = number_in(answer, key);
    }
    halcyon_unlock(before);
    return done;
}

bool hal_port_read(hal_port_t port, char *to, unsigned count) { return count > 0 && use_port(port, "read", to, NULL, count, NULL, NULL); }
bool hal_port_peek(hal_port_t port, char *to, unsigned count) { return count > 0 && use_port(port, "peek", to, NULL, count, NULL, NULL); }
bool hal_port_peek_commit(hal_port_t port, unsigned count) {
    char *const nowhere = malloc(count + 1);
    const bool done = nowhere && hal_port_read(port, nowhere, count);
    free(nowhere);
    return done;
}
bool hal_port_write(hal_port_t port, const char *from, unsigned count) {
    return count > 0 && use_port(port, "write", NULL, from, count, NULL, NULL);
}
static unsigned number_of(hal_port_t port, const char *key) {
    unsigned number = 0;
    use_port(port, "", NULL, NULL, 0, key, &number);
    return number;
}
unsigned hal_port_readable(hal_port_t port) { return number_of(port, "\"readable\":"); }
unsigned hal_port_writable(hal_port_t port) { return number_of(port, "\"writable\":"); }
unsigned hal_port_buffer_size(hal_port_t port) { return number_of(port, "\"size\":"); }
void hal_port_clear(hal_port_t port) { hal_port_peek_commit(port, hal_port_readable(port)); }
