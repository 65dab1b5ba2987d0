/* SPDX-License-Identifier: MIT */
/* The control protocol (docs/protocol.md) as a program needs it: requests are written as text,
 * replies are lines of JSON. */
#define _GNU_SOURCE
#include <math.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include "inside.h"
#include "program.h"

int halcyon_connection = -1;
char* halcyon_rejection;

/* --- text --- */

static struct text {
    char* at;
    size_t length, capacity;
} request, reply;
static size_t consumed; /* bytes of the reply: the line that was returned last */

void halcyon_add(const char* format, ...) {
    for (;;) {
        va_list arguments;
        va_start(arguments, format);
        const size_t capacity = request.capacity - request.length;
        const int length =
            vsnprintf(request.at ? request.at + request.length : NULL, capacity, format, arguments);
        va_end(arguments);
        if (length < 0) return;
        if ((size_t)length < capacity) {
            request.length += (size_t)length;
            return;
        }
        char* const larger = realloc(request.at, request.capacity * 2 + (size_t)length + 256);
        if (!larger) {
            return; /* the machine rejects the truncated request */
        }
        request.at = larger;
        request.capacity = request.capacity * 2 + (size_t)length + 256;
    }
}
void halcyon_add_string(const char* text) {
    halcyon_add("\"");
    for (; *text; ++text) {
        if ((unsigned char)*text < 0x20) {
            halcyon_add("\\u%04x", *text);
        } else {
            halcyon_add(*text == '"' || *text == '\\' ? "\\%c" : "%c", *text);
        }
    }
    halcyon_add("\"");
}
void halcyon_add_value(hal_type type, hal_value value) {
    switch (type) {
    case HAL_TYPE_BIT: halcyon_add(value.bit ? "true" : "false"); break;
    case HAL_TYPE_FLOAT:
        if (isnan(value.real)) {
            halcyon_add("\"nan\"");
        } else if (isinf(value.real)) {
            halcyon_add(value.real < 0 ? "\"-inf\"" : "\"inf\"");
        } else {
            halcyon_add("%.17g", value.real);
        }
        break;
    case HAL_TYPE_S32: halcyon_add("%d", (int)value.s32); break;
    case HAL_TYPE_U32: halcyon_add("%u", (unsigned)value.u32); break;
    case HAL_TYPE_S64: halcyon_add("%lld", (long long)value.s64); break;
    case HAL_TYPE_U64: halcyon_add("%llu", (unsigned long long)value.u64); break;
    case HAL_TYPE_PORT: halcyon_add("null"); break;
    }
}

void halcyon_add_number(hal_type type, double value) {
    if (type == HAL_TYPE_FLOAT) {
        halcyon_add_value(type, (hal_value){.real = value});
    } else if (type == HAL_TYPE_BIT) {
        halcyon_add(value != 0 ? "true" : "false");
    } else {
        halcyon_add("%.0f", value);
    }
}

uint64_t halcyon_significant(hal_type type, uint64_t raw) {
    const hal_value value = {.raw = raw};
    switch (type) {
    case HAL_TYPE_BIT: return value.bit;
    case HAL_TYPE_S32:
    case HAL_TYPE_U32: return value.u32;
    default: return raw;
    }
}

hal_value halcyon_take_value(const char** at, hal_type type) {
    const bool quoted = **at == '"';
    if (quoted) {
        ++*at;
    }
    hal_value value = {.raw = 0};
    char* end = (char*)*at;
    if (strncmp(end, "true", 4) == 0) {
        value.bit = true;
    } else if (type == HAL_TYPE_FLOAT) {
        value.real = strtod(*at, &end);
    } else if (type == HAL_TYPE_U32 || type == HAL_TYPE_U64) {
        value.u64 = strtoull(*at, &end, 10);
    } else if (type == HAL_TYPE_S32 || type == HAL_TYPE_S64) {
        value.s64 = strtoll(*at, &end, 10);
    }
    *at = end + strcspn(end, ",]");
    if (**at == ',') {
        ++*at;
    }
    return value;
}

/* --- the connection --- */

void halcyon_disconnect(void) {
    if (halcyon_connection >= 0) {
        close(halcyon_connection);
    }
    halcyon_connection = -1;
    reply.length = consumed = 0;
}

/* Returns the machine's next line without its end; NULL when the connection is lost. */
static char* receive_line(void) {
    reply.length -= consumed;
    if (consumed > 0) {
        memmove(reply.at, reply.at + consumed, reply.length);
    }
    consumed = 0;
    for (size_t searched = 0;;) {
        char* const end = reply.length > searched
                              ? memchr(reply.at + searched, '\n', reply.length - searched)
                              : NULL;
        if (end) {
            *end = '\0';
            consumed = (size_t)(end - reply.at) + 1;
            return reply.at;
        }
        searched = reply.length;
        if (reply.capacity - reply.length < 4096) {
            char* const larger = realloc(reply.at, reply.capacity * 2 + 8192);
            if (!larger) return NULL;
            reply.at = larger;
            reply.capacity = reply.capacity * 2 + 8192;
        }
        const ssize_t got =
            recv(halcyon_connection, reply.at + reply.length, reply.capacity - reply.length, 0);
        if (got < 0 && errno == EINTR) continue;
        if (got <= 0) return NULL;
        reply.length += (size_t)got;
    }
}

char* halcyon_ask(void) {
    halcyon_add("\n");
    for (size_t sent = 0; halcyon_connection >= 0 && sent < request.length;) {
        const ssize_t n =
            send(halcyon_connection, request.at + sent, request.length - sent, MSG_NOSIGNAL);
        if (n < 0 && errno == EINTR) continue;
        if (n <= 0) {
            halcyon_disconnect();
        } else {
            sent += (size_t)n;
        }
    }
    request.length = 0;
    char* const answer = halcyon_connection >= 0 ? receive_line() : NULL;
    if (!answer) {
        halcyon_disconnect();
    }
    if (answer && strstr(answer, "\"ok\":true")) return answer;
    char* error = answer ? strstr(answer, "\"error\":\"") : NULL;
    free(halcyon_rejection);
    halcyon_rejection = strdup(error ? error + 9 : "the machine does not respond");
    if (error && halcyon_rejection) {
        halcyon_rejection[strcspn(halcyon_rejection, "\"")] = '\0';
    }
    return NULL;
}

void halcyon_drop_request(void) { request.length = 0; }

bool halcyon_use_port(const struct halcyon_link* port, const char* verb, char* to, const char* from,
                      unsigned count, const char* key, unsigned* number) {
    if (halcyon_connection < 0) return false;
    halcyon_add("{\"port\":\"%s.%s\"", port->prefix, port->name);
    if (to) {
        halcyon_add(",\"%s\":%u", verb, count);
    }
    if (from) {
        halcyon_add(",\"write\":\"");
    }
    for (unsigned i = 0; from && i < count; ++i) {
        halcyon_add("%02x", (unsigned char)from[i]);
    }
    halcyon_add(from ? "\"}" : "}");
    const char* const answer = halcyon_ask();
    if (!answer && halcyon_connection >= 0) {
        rtapi_print_msg(RTAPI_MSG_ERR, "%s.%s: %s\n", port->prefix, port->name, halcyon_rejection);
    }
    const char* const bytes = answer ? strstr(answer, "\"bytes\":\"") : NULL;
    const bool done = answer && strstr(answer, "\"done\":true");
    for (unsigned i = 0; done && to && bytes && i < count; ++i) {
        const char pair[3] = {bytes[9 + 2 * i], bytes[10 + 2 * i], '\0'};
        to[i] = (char)strtoul(pair, NULL, 16);
    }
    const char* const at = answer && key ? strstr(answer, key) : NULL;
    if (key) {
        *number = at ? (unsigned)strtoul(at + strlen(key), NULL, 10) : 0;
    }
    return done;
}

/* --- the machine --- */

const char* halcyon_instance(void) {
    const char* const named = getenv("HALCYON_INSTANCE");
    return named && *named ? named : "default";
}

long halcyon_connect(void) {
    struct sockaddr_un address = {.sun_family = AF_UNIX};
    const char* const runtime = getenv("XDG_RUNTIME_DIR");
    if (runtime && *runtime == '/') {
        snprintf(address.sun_path, sizeof address.sun_path, "%s/halcyon/%s.sock", runtime,
                 halcyon_instance());
    } else {
        snprintf(address.sun_path, sizeof address.sun_path, "/tmp/halcyon-%u/%s.sock",
                 (unsigned)getuid(), halcyon_instance());
    }
    halcyon_disconnect();
    halcyon_connection = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    const struct timeval timeout = {.tv_sec = 10};
    setsockopt(halcyon_connection, SOL_SOCKET, SO_RCVTIMEO, &timeout, sizeof timeout);
    const char* const hello =
        connect(halcyon_connection, (struct sockaddr*)&address, sizeof address) == 0
            ? receive_line()
            : NULL;
    if (hello && strncmp(hello, "{\"halcyon\":1,", 13) == 0) {
        const char* const pid = strstr(hello, "\"pid\":");
        return pid ? strtol(pid + 6, NULL, 10) : 0;
    }
    halcyon_disconnect();
    return -1;
}

bool halcyon_connection_lost(void) {
    struct pollfd events = {.fd = halcyon_connection, .events = POLLIN};
    return halcyon_connection < 0 ||
           (poll(&events, 1, 0) > 0 && (events.revents & (POLLHUP | POLLERR)));
}
