/* SPDX-License-Identifier: MIT */
/*
 * What the C source that `hal compile` makes of a .comp file includes: HAL's headers, and the
 * instance's constructor as far as it is the same for all components. Everything is called
 * __comp_…, which a .comp file may not use itself. A pin stands in `struct __comp_state` as a
 * hal_pin, whose first member is the address of its value.
 */
#ifndef HAL_LINUXCNC_COMP_INSTANCE_H
#define HAL_LINUXCNC_COMP_INSTANCE_H

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "hal.h"
#include "hal/abi.h"
#include "hal/naming.h"
#include "rtapi.h"
#include "rtapi_app.h"
#include "rtapi_string.h"

/* What hal.h and rtapi.h need to know of an instance: comp_component.c, in a program
 * comp_program.c. [setup] */
bool halcyon_enter(const hal_host* of, const char* instance);
bool halcyon_fail_setup(const char* function, int result);
bool halcyon_leave(bool good);
bool halcyon_start(void* self, const hal_host* of);
void halcyon_stop(void* self);
void halcyon_gone(void);
const hal_host* halcyon_host(void);
bool halcyon_step(const hal_host* of, hal_function_decl* decl);

#ifndef TRUE
#define TRUE 1
#endif
#ifndef FALSE
#define FALSE 0
#endif

static int comp_id __attribute__((unused)) = 1; /* what hal_init() would have given */

typedef struct __comp_item {
    size_t offset; /* of the first hal_pin in the instance */
    unsigned max; /* capacity in elements */
    hal_type type;
    hal_dir dir;
    unsigned flags;
    const char *name, *doc;
} __comp_item;

typedef struct __comp_function {
    const char *name, *doc;
    hal_step step;
} __comp_function;

/* One call of create. */
typedef struct __comp_context {
    const hal_host* host;
    char prefix[256]; /* the instance's name */
    long number; /* instances made since there was none */
    bool whole; /* names stand for themselves: rtapi_app_main() is the file's own */
} __comp_context;

static inline bool __comp_fail(const __comp_context* context, const char* reason) {
    context->host->fail(context->host, reason);
    return false;
}
static inline bool __comp_reject(const __comp_context* context, const char* argument,
                                 const char* reason) {
    const hal_rejection rejection = {
        sizeof rejection, HAL_SUBJECT_ARGUMENT, argument, 0, 0, "", reason, ""};
    if (context->host->size <= HAL_HOST_SIZE_1_1 || !context->host->reject) {
        return __comp_fail(context, reason);
    }
    context->host->reject(context->host, &rejection);
    return false;
}

/* A whole number from a load argument. */
static inline bool __comp_number(const __comp_context* context, const char* name, const char* doc,
                                 const char* fallback, int* value) {
    const hal_argument_decl decl = {sizeof decl, 0, name, doc, fallback};
    const char* const text = context->host->argument(context->host, &decl);
    char reason[200], *end = 0;
    if (!text) return true;
    errno = 0;
    const long long read = strtoll(text, &end, 0);
    if (end != text && !*end && !errno && read >= -2147483647 - 1 && read <= 4294967295LL) {
        *value = (int)read;
        return true;
    }
    snprintf(reason, sizeof reason, "%s=%.100s is not a whole number of 32 bits", name, text);
    return __comp_reject(context, name, reason);
}

static inline bool __comp_personality(const __comp_context* context, const char* fallback,
                                      int* value) {
    return __comp_number(context, "personality", "which pins there are; a number per instance",
                         fallback, value);
}

static inline void __comp_prepare(void* instance, const __comp_item* items, size_t count) {
    for (size_t i = 0; i < count; ++i) {
        for (unsigned k = 0; k < items[i].max; ++k) {
            hal_pin* const pin = (hal_pin*)((char*)instance + items[i].offset) + k;
            pin->slot = &pin->own;
        }
    }
}

/* stem: the component's name without hal_, which is how its instances are called. */
static inline bool __comp_begin(__comp_context* context, const char* stem, bool renamed,
                                bool first) {
    static long made;
    const hal_naming* const naming = context->host->extension(context->host, HAL_NAMING);
    const bool named = naming && naming->size >= sizeof *naming;
    if (first) {
        made = 0;
    }
    context->number = made++;
    if (naming && renamed) {
        naming->instance(context->host, stem, 0);
    }
    if (named) {
        snprintf(context->prefix, sizeof context->prefix, "%s", naming->name(context->host));
    } else {
        snprintf(context->prefix, sizeof context->prefix, "%s.%ld", stem, context->number);
    }
    return halcyon_enter(context->host, context->prefix);
}

/* The same for an instance that the file's own rtapi_app_main() makes. */
static inline void __comp_begin_as(__comp_context* context, const char* prefix, long number) {
    snprintf(context->prefix, sizeof context->prefix, "%s", prefix);
    context->number = number;
    context->whole = true;
}

/* Checks what EXTRA_SETUP or POST_EXPORT returned. */
static inline bool __comp_called(const char* name, int result) {
    return result >= 0 || halcyon_fail_setup(name, result);
}

/* Takes the number of instances from get_count(). */
static inline bool __comp_counted(const __comp_context* context, int result) {
    char reason[100];
    const hal_naming* const naming = context->host->extension(context->host, HAL_NAMING);
    if (result > context->number) {
        if (naming) {
            naming->count(context->host, "count", (uint64_t)result);
        }
        return true;
    }
    snprintf(reason, sizeof reason, "get_count() returned %d; this would be instance %ld", result,
             context->number + 1);
    return __comp_fail(context, reason);
}

static inline long __comp_count(long wanted) { return wanted < 0 ? 0 : wanted; }

/* The name as the runtime takes it. */
static inline const char* __comp_full(const __comp_context* context, const char* name,
                                      char* capacity, size_t size) {
    if (!context->whole) return name;
    snprintf(capacity, size, *name ? "%s.%s" : "%s", context->prefix, name);
    return capacity;
}

/* The name with its block of # as a number; without one, the name itself. */
static inline void __comp_numbered(char* to, size_t capacity, const char* name, unsigned index) {
    const char* const hash = strchr(name, '#');
    if (!hash) {
        snprintf(to, capacity, "%s", name);
        return;
    }
    const int width = (int)strspn(hash, "#");
    snprintf(to, capacity, "%.*s%0*u%s", (int)(hash - name), name, width, index, hash + width);
}

/* counts: elements of an array; 1 or 0 for anything else, -1 standing for 1. */
static inline bool __comp_pins(const __comp_context* context, void* instance,
                               const __comp_item* items, const long* counts, size_t count) {
    char name[512], full[800], reason[700];
    for (size_t i = 0; i < count; ++i) {
        const long wanted = counts[i] < 0 ? 1 : counts[i];
        if (wanted > (long)items[i].max) {
            snprintf(reason, sizeof reason,
                     "personality asks for %ld pins %s, there are at most %u", wanted,
                     items[i].name, items[i].max);
            return __comp_fail(context, reason);
        }
        for (unsigned k = 0; k < (unsigned)wanted; ++k) {
            hal_pin* const pin = (hal_pin*)((char*)instance + items[i].offset) + k;
            const hal_value none = {0};
            __comp_numbered(name, sizeof name, items[i].name, k);
            const hal_pin_decl decl = {sizeof decl,
                                       items[i].type,
                                       items[i].dir,
                                       items[i].flags,
                                       __comp_full(context, name, full, sizeof full),
                                       items[i].doc,
                                       "",
                                       pin->own,
                                       none,
                                       0};
            if (!context->host->pin(context->host, &decl, pin)) return false;
        }
    }
    return true;
}

static inline bool __comp_export(const __comp_context* context, void* instance,
                                 const __comp_function* functions, size_t count) {
    char full[800];
    for (size_t i = 0; i < count; ++i) {
        hal_function_decl decl = {sizeof decl,
                                  0,
                                  __comp_full(context, functions[i].name, full, sizeof full),
                                  functions[i].doc,
                                  functions[i].step,
                                  instance,
                                  functions + i};
        if (!halcyon_step(context->host, &decl) || !context->host->function(context->host, &decl)) {
            return false;
        }
    }
    return true;
}

/* NAME_set() gives what it has set. */
static inline rtapi_bool __comp_set_bit(volatile rtapi_bool* at, rtapi_bool value) {
    *at = value;
    return value;
}
static inline rtapi_real __comp_set_real(volatile rtapi_real* at, rtapi_real value) {
    *at = value;
    return value;
}
static inline rtapi_s32 __comp_set_s32(volatile rtapi_s32* at, rtapi_s32 value) {
    *at = value;
    return value;
}
static inline rtapi_u32 __comp_set_u32(volatile rtapi_u32* at, rtapi_u32 value) {
    *at = value;
    return value;
}
static inline rtapi_s64 __comp_set_s64(volatile rtapi_s64* at, rtapi_s64 value) {
    *at = value;
    return value;
}
static inline rtapi_u64 __comp_set_u64(volatile rtapi_u64* at, rtapi_u64 value) {
    *at = value;
    return value;
}

#endif
