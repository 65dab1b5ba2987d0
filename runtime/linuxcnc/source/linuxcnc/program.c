/* SPDX-License-Identifier: MIT */
/*
 * hal.h in a program: its pins live in the running machine, which it reaches by the control socket
 * (docs/protocol.md). `hal compile` compiles this file with the user's main(), or with that of
 * comp_program.c; LinuxCNC's own programs find it in runtime/linuxcnc/programs.
 *
 * Every pin has a value in this process, where the program reads and writes it. program_exchange.c
 * exchanges the values. When the machine ends, HALCYON_LOST=end (which loadusr sets) ends the
 * program as SIGTERM does; otherwise it reconnects when the machine is back.
 */
#define _GNU_SOURCE
#include <locale.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "inside.h"
#include "program.h"

const hal_host* halcyon_current_host; /* set by hal_init() */
struct halcyon_program halcyon_programs[halcyon_most_programs];
static hal_host hosts[halcyon_most_programs]; /* `data` is the program */
/* of the programs and of the connection; never held while the program's code runs */
static pthread_mutex_t mutex = PTHREAD_MUTEX_INITIALIZER;

static struct halcyon_program* program_of(int comp) {
    const int place = comp - halcyon_first_id;
    return place >= 0 && place < halcyon_most_programs && *halcyon_programs[place].name
               ? &halcyon_programs[place]
               : NULL;
}
const char* halcyon_program_name(void) {
    for (size_t i = 0; i < halcyon_most_programs; ++i) {
        if (*halcyon_programs[i].name) return halcyon_programs[i].name;
    }
    return HALCYON_COMPONENT;
}
const hal_host* halcyon_host_of(int comp) {
    return program_of(comp) ? &hosts[comp - halcyon_first_id] : NULL;
}

/* --- the host --- */

locale_t halcyon_lock(void) {
    static locale_t plain;
    pthread_mutex_lock(&mutex);
    if (!plain) {
        plain = newlocale(LC_ALL_MASK, "C", (locale_t)0);
    }
    return uselocale(plain);
}
void halcyon_unlock(locale_t before) {
    uselocale(before);
    pthread_mutex_unlock(&mutex);
}

static bool report_rejection(const char* program, const char* of) {
    rtapi_print_msg(RTAPI_MSG_ERR, "%s: %s: %s\n", program, of,
                    halcyon_rejection ? halcyon_rejection : "out of memory");
    return false;
}

static bool take_pin(const hal_host* host_itself, const hal_pin_decl* decl, hal_pin* pin) {
    struct halcyon_program* const of = host_itself->data;
    const char* const dot = *halcyon_program_prefix ? NULL : strchr(decl->name, '.');
    if (!*halcyon_program_prefix && !dot) {
        rtapi_print_msg(RTAPI_MSG_ERR, "%s: the name of pin '%s' has no '.'\n", of->name,
                        decl->name);
        return false;
    }
    const locale_t before = halcyon_lock();
    bool good = true;
    if (of->link_count == of->link_capacity) {
        const size_t capacity = of->link_capacity * 2 + 16;
        struct halcyon_link* const larger = realloc(of->links, capacity * sizeof *of->links);
        if ((good = larger)) {
            of->links = larger;
            of->link_capacity = capacity;
        }
    }
    struct halcyon_link one = {.pin = pin, .type = decl->type, .dir = decl->dir};
    one.read_only = decl->dir == HAL_DIR_PARAM && (decl->flags & HAL_PIN_READ_ONLY);
    one.prefix =
        dot ? strndup(decl->name, (size_t)(dot - decl->name)) : strdup(halcyon_program_prefix);
    one.name = strdup(dot ? dot + 1 : decl->name);
    one.doc = strdup(decl->doc);
    pin->own = decl->initial;
    pin->slot = &pin->own;
    good = good && one.prefix && one.name && one.doc && halcyon_declare(of, &one);
    if (good) {
        of->links[of->link_count++] = one;
    }
    if (good && decl->pointer) {
        *decl->pointer = pin->slot; /* a pin that is rejected leaves the pointer as it is */
    }
    halcyon_unlock(before);
    return good || report_rejection(of->name, decl->name);
}
static bool take_function(const hal_host* host_itself, const hal_function_decl* decl) {
    rtapi_print_msg(RTAPI_MSG_ERR, "%s: '%s': a program cannot have functions for threads\n",
                    ((struct halcyon_program*)host_itself->data)->name, decl->name);
    return false;
}
static const char* take_argument(const hal_host* host_itself, const hal_argument_decl* decl) {
    (void)host_itself;
    return decl->fallback;
}
static void* allocate(const hal_host* host_itself, size_t bytes, size_t align) {
    (void)host_itself;
    void* const memory = aligned_alloc(align, (bytes + align - 1) / align * align);
    return memory ? memset(memory, 0, bytes) : NULL;
}
static void take_failure(const hal_host* host_itself, const char* reason) {
    rtapi_print_msg(RTAPI_MSG_ERR, "%s: %s\n", ((struct halcyon_program*)host_itself->data)->name,
                    reason);
}
static const char* prefix_of(const hal_host* host_itself) {
    return (void)host_itself, halcyon_program_prefix;
}
static void ignore_instance(const hal_host* host_itself, const char* prefix, unsigned digits) {
    (void)host_itself, (void)prefix, (void)digits;
}
static void ignore_count(const hal_host* host_itself, const char* argument, uint64_t count) {
    (void)host_itself, (void)argument, (void)count;
}
static void ignore_names(const hal_host* host_itself) { (void)host_itself; }
static const hal_naming naming = {sizeof naming, ignore_instance, ignore_names, ignore_count,
                                  prefix_of};
static const void* extension(const hal_host* host_itself, const char* id) {
    (void)host_itself;
    return strcmp(id, HAL_NAMING) == 0 ? &naming : NULL;
}

char halcyon_program_prefix[256];

/* --- life --- */

int hal_init(const char* name) {
    if (!name || !*name || strlen(name) > HAL_NAME_LEN) return -EINVAL;
    if (halcyon_begins) {
        halcyon_begins();
    }
    const locale_t before = halcyon_lock();
    struct halcyon_program* of = NULL;
    bool others = false;
    bool again = false;
    for (size_t i = halcyon_most_programs; i-- > 0;) {
        if (!*halcyon_programs[i].name) {
            of = &halcyon_programs[i];
        } else {
            others = true;
            again = again || strcmp(halcyon_programs[i].name, name) == 0;
        }
    }
    const int id = of ? (int)(of - halcyon_programs) + halcyon_first_id : -ENOMEM;
    if (!of || again) {
        halcyon_unlock(before);
        return again ? -EEXIST : id;
    }
    strcpy(of->name, name);
    const bool found = (others && !halcyon_connection_lost()) || halcyon_find_machine();

    const bool good = found && halcyon_announce(of, false, false);
    if (!good) {
        *of->name = '\0';
    }
    halcyon_unlock(before);
    const char* const missing =
        "%s: no machine '%s' is running (hal run FILE.hal; HALCYON_INSTANCE names another)\n";
    if (!found) {
        rtapi_print_msg(RTAPI_MSG_ERR, missing, name, halcyon_instance());
    } else if (!good) {
        report_rejection(name, "cannot register");
    }
    if (!good) return -EINVAL;
    hosts[id - halcyon_first_id] =
        (hal_host){sizeof(hal_host), of,           take_pin,  take_function, take_argument,
                   allocate,         take_failure, extension, NULL};
    halcyon_current_host = &hosts[id - halcyon_first_id];
    halcyon_catch_end_signals();
    return id;
}

static int set_ready(struct halcyon_program* of, bool is_ready) {
    if (!of) return -EINVAL;
    const locale_t before = halcyon_lock();
    if (is_ready) {
        halcyon_exchange(of);
    }
    const bool good = halcyon_announce(of, is_ready, true);
    of->ready = is_ready;
    halcyon_unlock(before);
    if (!good) {
        report_rejection(of->name, "ready");
        return -EINVAL;
    }
    return !is_ready || halcyon_start_helper() ? 0 : -EAGAIN;
}

int hal_ready(int comp) { return set_ready(program_of(comp), true); }
int hal_unready(int comp) { return set_ready(program_of(comp), false); }

int hal_exit(int comp) {
    struct halcyon_program* const of = program_of(comp);
    if (!of) {
        return comp >= halcyon_first_id && comp < halcyon_first_id + halcyon_most_programs
                   ? 0
                   : -EINVAL;
    }
    locale_t before = halcyon_lock();
    if (halcyon_connection >= 0) {
        halcyon_exchange(of);
    }
    halcyon_unregister(of);
    *of = (struct halcyon_program){.links = of->links, .link_capacity = of->link_capacity};
    halcyon_ending = halcyon_connection < 0;
    for (size_t i = 0; i < halcyon_most_programs; ++i) {
        halcyon_ending = halcyon_ending && !*halcyon_programs[i].name;
    }
    const bool last = halcyon_ending;
    halcyon_unlock(before);
    if (last) {
        halcyon_stop_helper();
    }
    return 0;
}

char* hal_comp_name(int comp) { return program_of(comp) ? program_of(comp)->name : NULL; }
void* hal_malloc(long size) { return size > 0 ? allocate(NULL, (size_t)size, 16) : NULL; }

int halcyon_every(int comp, unsigned every, unsigned timeout) {
    struct halcyon_program* const of = program_of(comp);
    if (!of) return -EINVAL;
    const locale_t before = halcyon_lock();
    of->every_ms = every;
    of->timeout_ms = timeout;
    of->alive = true;
    halcyon_add("{\"component\":");
    halcyon_add_string(of->name);
    halcyon_add(",\"every_ms\":%u,\"timeout_ms\":%u,\"ready\":%s}", every, timeout,
                of->ready ? "true" : "false");
    const bool good = halcyon_ask();
    halcyon_unlock(before);
    return good ? 0 : (report_rejection(of->name, "halcyon_every"), -EINVAL);
}

int halcyon_alive(int comp) {
    struct halcyon_program* const of = program_of(comp);
    if (!of) return -EINVAL;
    __atomic_store_n(&of->alive, true, __ATOMIC_RELEASE);
    return 0;
}

int halcyon_safe(int comp, const char* pin, double value) {
    struct halcyon_program* const of = program_of(comp);
    if (!of) return -EINVAL;
    const locale_t before = halcyon_lock();
    struct halcyon_link* one = NULL;
    for (size_t i = 0; i < of->link_count; ++i) {
        const size_t prefix = strlen(of->links[i].prefix);
        if (strncmp(pin, of->links[i].prefix, prefix) == 0 && pin[prefix] == '.' &&
            strcmp(pin + prefix + 1, of->links[i].name) == 0) {
            one = &of->links[i];
        }
    }
    const bool fits = one && one->type != HAL_TYPE_PORT;
    if (fits) {
        one->safe = true;
        one->safe_value = value;
    }
    const bool good = fits && halcyon_announce(of, of->ready, true);
    if (one && !good) {
        one->safe = false;
    }
    halcyon_unlock(before);
    if (!fits) {
        rtapi_print_msg(RTAPI_MSG_ERR, "%s: halcyon_safe: unknown pin '%s', or it has no value\n",
                        of->name, pin);
    }
    if (fits && !good) {
        report_rejection(of->name, pin);
    }
    return good ? 0 : -EINVAL;
}

bool halcyon_connected(int comp) {
    if (!program_of(comp)) return false;
    const locale_t before = halcyon_lock();
    const bool there = !halcyon_connection_lost();
    halcyon_unlock(before);
    return there;
}
