/* SPDX-License-Identifier: MIT */
/* LinuxCNC's functions that act on the machine as a whole: each is a command to it, or asks it. All
 * [setup]; 0, or a negative errno. */
#define _GNU_SOURCE
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "commands.h"
#include "linuxcnc/inside.h"
#include "linuxcnc/program.h"

/* A program connects with its first hal_init(). */
int halcyon_run(const char* const* words, const char* key, unsigned* number) {
    const locale_t before = halcyon_lock();
    char* reason = NULL;
    bool done = false;
    if (halcyon_connection >= 0) {
        halcyon_add("{\"run\":[");
        for (size_t i = 0; words[i]; ++i) {
            if (i > 0) {
                halcyon_add(",");
            }
            halcyon_add_string(words[i]);
        }
        halcyon_add("],\"name\":");
        halcyon_add_string(halcyon_program_name());
        halcyon_add("}");
        const char* const answer = halcyon_ask();
        done = answer && strstr(answer, "\"status\":0");
        const char* const found = done && key ? strstr(answer, key) : NULL;
        if (found) {
            *number = (unsigned)strtoul(found + strlen(key), NULL, 10);
        }
        const char* const text = answer && !done ? strstr(answer, "\"err\":\"") : NULL;
        if (text) {
            reason = strndup(text + 7, strcspn(text + 7, "\\\""));
        } else if (!answer && halcyon_rejection) {
            reason = strdup(halcyon_rejection);
        }
    }
    halcyon_unlock(before);
    if (!done) {
        rtapi_print_msg(RTAPI_MSG_ERR, "%s: %s failed: %s\n", halcyon_program_name(), words[0],
                        reason ? reason : "the program is not connected; hal_init() connects it");
    }
    free(reason);
    return done ? 0 : -EINVAL;
}

/// Returns the name of a type in netlists; NULL: signals have no such type.
static const char* type_name(hal_type_t type) {
    switch (type) {
    case HAL_BIT: return "bit";
    case HAL_FLOAT: return "float";
    case HAL_S32: return "s32";
    case HAL_U32: return "u32";
    case HAL_S64: return "s64";
    case HAL_U64: return "u64";
    default: return NULL;
    }
}

int hal_signal_new(const char* name, hal_type_t type) {
    const char* const word = type_name(type);
    return word ? RUN("newsig", name, word) : -EINVAL;
}
int hal_set_unready(int comp) { return hal_unready(comp); }
int hal_signal_delete(const char* name) { return RUN("delsig", name); }
int hal_link(const char* pin, const char* signal) { return RUN("linkps", pin, signal); }
int hal_unlink(const char* pin) { return RUN("unlinkp", pin); }
int hal_pin_alias(const char* name, const char* alias) {
    return alias ? RUN("alias", "pin", name, alias) : RUN("unalias", "pin", name);
}
int hal_param_alias(const char* name, const char* alias) {
    return alias ? RUN("alias", "param", name, alias) : RUN("unalias", "param", name);
}
int hal_add_funct_to_thread(const char* function, const char* thread, int position) {
    char place[16];
    snprintf(place, sizeof place, "%d", position);
    return RUN("addf", function, thread, place);
}
int hal_del_funct_from_thread(const char* function, const char* thread) {
    return RUN("delf", function, thread);
}
int hal_start_threads(void) { return RUN("start"); }
int hal_stop_threads(void) { return RUN("stop"); }

unsigned char hal_get_lock(void) {
    unsigned lock = 0;
    halcyon_run((const char* const[]){"status", "lock", NULL}, "lock value ", &lock);
    return (unsigned char)lock;
}
int hal_set_lock(unsigned char lock) {
    static const struct {
        unsigned char value;
        const char* word;
    } levels[] = {{0, "none"}, {3, "tune"}, {255, "all"}};
    for (size_t i = 0; i < sizeof levels / sizeof *levels; ++i) {
        if (levels[i].value == lock) return RUN("lock", levels[i].word);
    }
    rtapi_print_msg(RTAPI_MSG_ERR,
                    "%s: hal_set_lock: a program sets 0 (none), 3 (tune) or 255 (all), not %u\n",
                    halcyon_program_name(), lock);
    return -EINVAL;
}

/* --- values by name --- */

/* Asks for a value by name. `data` leads to a copy, which the next call of the same thread
 * overwrites. */
static int value_of(const char* kind, const char* name, int* type, union halcyon_data** data,
                    bool* flag, bool of_signal) {
    static _Thread_local struct halcyon_object found;
    if (!type || !data || halcyon_look_up(kind, name, &found) != 0) return -EINVAL;
    *type = found.type;
    *data = &found.value;
    if (flag) {
        *flag = of_signal ? found.has_writer : *found.signal != '\0';
    }
    return 0;
}
int hal_get_pin_value_by_name(const char* name, int* type, union halcyon_data** data,
                              bool* connected) {
    return value_of("pin", name, type, data, connected, false);
}
int hal_get_signal_value_by_name(const char* name, int* type, union halcyon_data** data,
                                 bool* has_writers) {
    return value_of("sig", name, type, data, has_writers, true);
}
int hal_get_param_value_by_name(const char* name, int* type, union halcyon_data** data) {
    return value_of("param", name, type, data, NULL, false);
}

int hal_param_set(const char* name, int type, void* value) {
    char text[40];
    if (!value) return -EINVAL;
    switch (type) {
    case HAL_BIT: snprintf(text, sizeof text, "%d", *(bool*)value); break;
    case HAL_FLOAT: snprintf(text, sizeof text, "%.17g", *(double*)value); break;
    case HAL_S32: snprintf(text, sizeof text, "%d", (int)*(int32_t*)value); break;
    case HAL_U32: snprintf(text, sizeof text, "%u", (unsigned)*(uint32_t*)value); break;
    case HAL_S64: snprintf(text, sizeof text, "%lld", (long long)*(int64_t*)value); break;
    case HAL_U64: snprintf(text, sizeof text, "%llu", (unsigned long long)*(uint64_t*)value); break;
    default: return -EINVAL;
    }
    return RUN("setp", name, text);
}
int hal_param_bit_set(const char* name, int value) {
    return hal_param_set(name, HAL_BIT, &(bool){value != 0});
}
int hal_param_float_set(const char* name, double value) {
    return hal_param_set(name, HAL_FLOAT, &value);
}
int hal_param_s32_set(const char* name, signed long value) {
    return hal_param_set(name, HAL_S32, &(int32_t){(int32_t)value});
}
int hal_param_u32_set(const char* name, unsigned long value) {
    return hal_param_set(name, HAL_U32, &(uint32_t){(uint32_t)value});
}
int hal_param_s64_set(const char* name, signed long value) {
    return hal_param_set(name, HAL_S64, &(int64_t){value});
}
int hal_param_u64_set(const char* name, unsigned long value) {
    return hal_param_set(name, HAL_U64, &(uint64_t){value});
}

/* --- what a program does not have --- */

/* In LinuxCNC a piece of its memory, for halcmd's `sets`. */
int hal_port_alloc(unsigned size) {
    rtapi_print_msg(RTAPI_MSG_ERR,
                    "%s: hal_port_alloc: a signal of type port gets its buffer by the command: "
                    "sets SIGNAL %u\n",
                    halcyon_program_name(), size);
    return 0;
}

int rtapi_fifo_new(int key, int module, unsigned long size, char mode) {
    return (void)key, (void)module, (void)size, (void)mode, -ENOSYS;
}
int rtapi_fifo_delete(int fifo, int module) { return (void)fifo, (void)module, -ENOSYS; }
int rtapi_fifo_read(int fifo, char* to, unsigned long size) {
    return (void)fifo, (void)to, (void)size, -ENOSYS;
}
int rtapi_fifo_write(int fifo, char* from, unsigned long size) {
    return (void)fifo, (void)from, (void)size, -ENOSYS;
}
