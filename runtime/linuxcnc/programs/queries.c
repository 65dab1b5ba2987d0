/* SPDX-License-Identifier: MIT */
/* What LinuxCNC 2.10 has for programs beside the pins by handle (declare.c): values by name in a
 * structure. All [setup]. */
#define _GNU_SOURCE
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "commands.h"
#include "linuxcnc/inside.h"
#include "linuxcnc/program.h"

enum { of_pin = 1, of_parameter = 2, of_signal = 3 };

struct query {
    const char* name;
    int kind;
    uint64_t caller;
    int type; /* 0: any */
    void* reference;
    union halcyon_data value;
    union {
        struct {
            int dir;
            const char *alias, *signal, *component;
            int comp;
        } pin;
        struct {
            int writers, readers, both;
        } signal;
    } is;
};
_Static_assert(sizeof(void*) != 8 ||
                   (sizeof(struct query) == 88 && offsetof(struct query, type) == 24 &&
                    offsetof(struct query, is) == 48),
               "the layout of programs");

typedef int (*callback)(struct query*, void*);

/* Looks the query's name up. Its texts last until the next call of the same thread. */
static int look_up(struct query* q, bool signal) {
    static _Thread_local struct halcyon_object found;
    if (!q || !q->name) return -EINVAL;
    int kind = signal ? of_signal : of_pin;
    int result = -ENOENT;
    if (signal) {
        result = halcyon_look_up("sig", q->name, &found);
    }
    if (!signal && q->kind != of_parameter) {
        result = halcyon_look_up("pin", q->name, &found);
    }
    if (!signal && result != 0 && q->kind != of_pin) {
        kind = of_parameter;
        result = halcyon_look_up("param", q->name, &found);
    }
    if (result != 0) return result;
    if (q->type != 0 && q->type != found.type) return -EEXIST;
    q->kind = kind;
    q->type = found.type;
    q->value = found.value;
    q->reference = &q->value;
    memset(&q->is, 0, sizeof q->is);
    if (signal) {
        q->is.signal.writers = found.has_writer;
        /* those in both directions among them */
        q->is.signal.readers = found.pins - found.has_writer;
    } else {
        q->is.pin.dir = found.dir;
        q->is.pin.signal = *found.signal ? found.signal : NULL;
        q->is.pin.component = found.component;
    }
    return 0;
}

static int get(struct query* q, bool signal, callback then, void* arg) {
    const int result = look_up(q, signal);
    return result == 0 && then ? then(q, arg) : result;
}
int hal_get_p(struct query* q, callback then, void* arg) { return get(q, false, then, arg); }
int hal_get_s(struct query* q, callback then, void* arg) { return get(q, true, then, arg); }

static int set(struct query* q, bool signal, callback then, void* arg) {
    if (!q || !q->name || (!then && q->type == 0)) return -EINVAL;
    const union halcyon_data wanted = q->value;
    int result = look_up(q, signal);
    if (result != 0) return result;
    q->value = wanted;
    if (then && (result = then(q, arg)) != 0) return result;
    char text[40];
    switch (q->type) {
    case HAL_BIT: snprintf(text, sizeof text, "%d", q->value.bit); break;
    case HAL_FLOAT: snprintf(text, sizeof text, "%.17g", q->value.real); break;
    case HAL_S32:
    case HAL_S64: snprintf(text, sizeof text, "%lld", (long long)q->value.s64); break;
    case HAL_U32:
    case HAL_U64: snprintf(text, sizeof text, "%llu", (unsigned long long)q->value.raw); break;
    default: return -EBADF;
    }
    return signal ? RUN("sets", q->name, text) : RUN("setp", q->name, text);
}
int hal_set_p(struct query* q, callback then, void* arg) { return set(q, false, then, arg); }
int hal_set_s(struct query* q, callback then, void* arg) { return set(q, true, then, arg); }

int hal_init_funct_to_thread(const char* function, const char* thread, int position) {
    char place[16];
    snprintf(place, sizeof place, "%d", position);
    return function && thread ? RUN("initf", function, thread, place) : -EINVAL;
}

/* Without a component of its own a program asks and sets what is there. */
int hal_lib_init(void) {
    const locale_t before = halcyon_lock();
    const bool there = !halcyon_connection_lost() || halcyon_find_machine();
    halcyon_unlock(before);
    if (there) return 0;
    rtapi_print_msg(
        RTAPI_MSG_ERR,
        "no machine '%s' is running (hal run FILE.hal; HALCYON_INSTANCE names another)\n",
        halcyon_instance());
    return -EFAULT;
}
void hal_lib_exit(void) {}
int hal_is_init(void) { return halcyon_connection >= 0; }

const char* hal_strerror(int error) {
    const char* const text = strerrordesc_np(error < 0 ? -error : error);
    return text ? text : "unknown error";
}
int hal_get_realtime_type(void) {
    const int preempt_rt = 3;
    return access("/sys/kernel/realtime", F_OK) == 0 ? preempt_rt : 0;
}
