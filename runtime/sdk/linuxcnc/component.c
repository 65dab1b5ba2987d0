/* SPDX-License-Identifier: MIT */
/*
 * What stands behind hal.h and rtapi.h: a Halcyon component whose constructor calls the user's rtapi_app_main().
 * `hal compile FILE.c` compiles this file with the user's, with HALCYON_COMPONENT as the name of the plugin.
 *
 * Such a component keeps its state in static variables, so it has one instance; it chooses its number of channels itself,
 * under whole names. Its pins may be used by any of its functions, in whichever threads (HAL_COMPONENT_LOOSE_PINS).
 */
#define _GNU_SOURCE
#include <link.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define hal_plugin hal_plugin_as_declared /* it is filled in from MODULE_DESCRIPTION before anyone sees it */
#include "inside.h"
#undef hal_plugin
#include "rtapi_app.h"
#ifdef HALCYON_PROGRAM
#include "program.h"
#endif

void rtapi_app_exit(void) __attribute__((weak)); /* some components have none */

enum { component_id = 1 };

struct pin {
    hal_pin pin;
    hal_value *handle;    /* of a port by pointer: what the pointer points to */
    hal_value **pointer;  /* the user's, or &handle */
    volatile void *value; /* of a parameter by pointer: the user's variable */
    hal_value last;       /* of such a parameter: what both had when they were last compared */
    hal_type type;
    struct pin *next;
};
struct funct {
    hal_funct_t code;
    void *arg;
};

const hal_host *host; /* while create runs */
static struct pin *pins, *parameters; /* parameters: those by pointer, a row of its own */
static char component_name[HAL_NAME_LEN + 1];

#ifndef HALCYON_PROGRAM
/* --- load arguments --------------------------------------------------------------------------------------------------------- */

extern const struct halcyon_parameter *const __start_halcyon_parameters[] __attribute__((weak, visibility("hidden")));
extern const struct halcyon_parameter *const __stop_halcyon_parameters[] __attribute__((weak, visibility("hidden")));
extern const struct halcyon_note *const __start_halcyon_notes[] __attribute__((weak, visibility("hidden")));
extern const struct halcyon_note *const __stop_halcyon_notes[] __attribute__((weak, visibility("hidden")));

static bool refuse(const char *format, ...) __attribute__((format(printf, 1, 2)));
static bool refuse(const char *format, ...) {
    char why[2600];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(why, sizeof why, format, arguments);
    va_end(arguments);
    host->fail(host, why);
    return false;
}

static bool refuse_value(const char *argument, const char *value, const char *why) {
    char text[2600];
    snprintf(text, sizeof text, "%s=%s %s", argument, value, why);
    const hal_rejection rejection = {sizeof rejection, HAL_SUBJECT_ARGUMENT, argument, 0, 0, "", text, ""};
    if (host->size > HAL_HOST_SIZE_1_1 && host->reject) host->reject(host, &rejection);
    else host->fail(host, text);
    return false;
}

static bool take_element(const struct halcyon_parameter *p, int index, const char *text) {
    if (p->type == 's') {
        char *const copy = host->allocate(host, strlen(text) + 1, 1);
        if (!copy) return refuse("out of memory for %s=", p->name);
        strcpy(copy, text);
        ((char **)p->place)[index] = copy;
        return true;
    }
    char *end;
    errno = 0;
    const long value = strtol(text, &end, 0);
    if (errno != 0 || end == text || *end != '\0' || (p->type == 'i' && value != (int)value)) return refuse_value(p->name, text, "is not a whole number");
    if (p->type == 'i') ((int *)p->place)[index] = (int)value;
    else ((long *)p->place)[index] = value;
    return true;
}

static bool take_parameter(const struct halcyon_parameter *p) {
    char fallback[128] = "";
    if (p->most == 0) {
        if (p->type == 'i') snprintf(fallback, sizeof fallback, "%d", *(int *)p->place);
        else if (p->type == 'l') snprintf(fallback, sizeof fallback, "%ld", *(long *)p->place);
        else if (*(char **)p->place) snprintf(fallback, sizeof fallback, "%s", *(char **)p->place);
    }
    const hal_argument_decl decl = {sizeof decl, 0, p->name, p->doc, fallback};
    const char *const given = host->argument(host, &decl);
    if (!given || given == fallback) { /* a default may be written to as a given value may */
        const char *const usual = p->type == 's' && p->most == 0 ? *(char **)p->place : NULL;
        return !usual || take_element(p, 0, usual);
    }
    if (p->most == 0) return take_element(p, 0, given);
    int index = 0;
    for (const char *at = given;; ++index) {
        const char *const comma = strchrnul(at, ',');
        if (index >= p->most) {
            char why[40];
            snprintf(why, sizeof why, "has more than %d values", p->most);
            return refuse_value(p->name, given, why);
        }
        char *const element = strndup(at, (size_t)(comma - at));
        const bool good = element ? take_element(p, index, element) : refuse("out of memory for %s=", p->name);
        free(element);
        if (!good) return false;
        if (*comma == '\0') return true;
        at = comma + 1;
    }
}

#endif

/* --- pins and parameters ---------------------------------------------------------------------------------------------------- */

static bool hal_type_of(hal_type_t type, hal_type *to) {
    switch (type) {
        case HAL_BOOL: *to = HAL_TYPE_BIT; return true;
        case HAL_REAL: *to = HAL_TYPE_FLOAT; return true;
        case HAL_S32: *to = HAL_TYPE_S32; return true;
        case HAL_U32: *to = HAL_TYPE_U32; return true;
        case HAL_SINT: *to = HAL_TYPE_S64; return true;
        case HAL_UINT: *to = HAL_TYPE_U64; return true;
        case HAL_PORT: *to = HAL_TYPE_PORT; return true;
    }
    return false;
}

static size_t width_of(hal_type type) { return type == HAL_TYPE_BIT ? 1 : type == HAL_TYPE_S32 || type == HAL_TYPE_U32 ? 4 : 8; }

static struct pin *new_pin(void) {
    struct pin *const pin = host ? host->allocate(host, sizeof *pin, _Alignof(struct pin)) : NULL;
    if (!pin) return NULL;
    pin->pin.slot = &pin->pin.own;
    return pin;
}

static const char *within = ""; /* of a .comp file: the instance's name, below which the runtime takes names */

/* The name as the runtime wants it; NULL when it is not one of the instance's. */
static const char *below(const char *name) {
    const size_t length = strlen(within);
    if (!name || !*name || length == 0) return name && *name ? name : NULL;
    if (strncmp(name, within, length) != 0) return NULL;
    return name[length] == '.' ? name + length + 1 : name[length] == '\0' ? name + length : NULL;
}

static int declare(struct pin *pin, hal_type_t type, hal_pdir_t dir, hal_value initial, const char *name) {
    hal_pin_decl decl = {.size = sizeof decl, .name = below(name), .doc = "", .unit = "", .initial = initial, .pointer = pin->pointer};
    if (!decl.name || !*decl.name || !hal_type_of(type, &decl.type)) return -EINVAL;
    switch (dir) {
        case HAL_IN: decl.dir = HAL_DIR_IN; break;
        case HAL_OUT: decl.dir = HAL_DIR_OUT; break;
        case HAL_IO: decl.dir = HAL_DIR_IO; break;
        case HAL_RO: decl.flags = HAL_PIN_READ_ONLY; /* fallthrough */
        case HAL_RW: decl.dir = HAL_DIR_PARAM; break;
        default: return -EINVAL;
    }
    pin->type = decl.type;
    if (!host->pin(host, &decl, &pin->pin)) return -EINVAL;
    if (pin->pointer) *pin->pointer = pin->pin.slot;
    struct pin **const row = pin->value ? &parameters : &pins;
    pin->next = *row;
    *row = pin;
    return 0;
}

static int by_handle(hal_type_t type, bool parameter, hal_pdir_t dir, void *handle, hal_value initial, const char *format, va_list arguments) {
    if (!handle || (dir == HAL_RO || dir == HAL_RW) != parameter) return -EINVAL;
    char name[256];
    const int length = vsnprintf(name, sizeof name, format, arguments);
    if (length < 0 || (size_t)length >= sizeof name) return -EINVAL;
    struct pin *const pin = new_pin();
    if (!pin) return -ENOMEM;
    pin->pointer = handle;
    return declare(pin, type, dir, initial, name);
}

#define BY_HANDLE(function, type, hal_kind, parameter, member, ctype)                                            \
    int function(int comp, hal_pdir_t dir, type *handle, ctype initial, const char *name, ...) {     \
        (void)comp;                                                                                                  \
        hal_value value = {.raw = 0};                                                                                \
        value.member = initial;                                                                                      \
        va_list arguments;                                                                                           \
        va_start(arguments, name);                                                                                   \
        const int result = by_handle(hal_kind, parameter, dir, handle, value, name, arguments);                      \
        va_end(arguments);                                                                                           \
        return result;                                                                                               \
    }
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wvarargs" /* bool is promoted on its way, but it is not the last argument before them */
BY_HANDLE(hal_pin_new_bool, hal_bool_t, HAL_BOOL, false, bit, rtapi_bool)
BY_HANDLE(hal_param_new_bool, hal_bool_t, HAL_BOOL, true, bit, rtapi_bool)
BY_HANDLE(hal_pin_new_real, hal_real_t, HAL_REAL, false, real, rtapi_real)
BY_HANDLE(hal_param_new_real, hal_real_t, HAL_REAL, true, real, rtapi_real)
BY_HANDLE(hal_pin_new_sint, hal_sint_t, HAL_SINT, false, s64, rtapi_sint)
BY_HANDLE(hal_param_new_sint, hal_sint_t, HAL_SINT, true, s64, rtapi_sint)
BY_HANDLE(hal_pin_new_uint, hal_uint_t, HAL_UINT, false, u64, rtapi_uint)
BY_HANDLE(hal_param_new_uint, hal_uint_t, HAL_UINT, true, u64, rtapi_uint)
BY_HANDLE(hal_pin_new_si32, hal_sint_t, HAL_S32, false, s64, rtapi_s32) /* the whole slot: a 64-bit getter sees the same */
BY_HANDLE(hal_param_new_si32, hal_sint_t, HAL_S32, true, s64, rtapi_s32)
BY_HANDLE(hal_pin_new_ui32, hal_uint_t, HAL_U32, false, u64, rtapi_u32)
BY_HANDLE(hal_param_new_ui32, hal_uint_t, HAL_U32, true, u64, rtapi_u32)
#pragma GCC diagnostic pop

int hal_pin_new_port(int comp, hal_pdir_t dir, hal_port_t *handle, const char *name, ...) {
    (void)comp;
    va_list arguments;
    va_start(arguments, name);
    const int result = by_handle(HAL_PORT, false, dir, handle, (hal_value){.raw = 0}, name, arguments);
    va_end(arguments);
    return result;
}

int hal_param_new_fake(int comp, hal_refs_u *handle) {
    (void)comp;
    struct pin *const pin = new_pin();
    if (!pin) return -ENOMEM;
    handle->p = (hal_port_t)(void *)&pin->pin.own;
    return 0;
}

int hal_pin_new(const char *name, hal_type_t type, hal_pdir_t dir, void **pointer, int comp) {
    (void)comp;
    if (!pointer || dir == HAL_RO || dir == HAL_RW) return -EINVAL;
    struct pin *const pin = new_pin();
    if (!pin) return -ENOMEM;
    pin->pointer = (hal_value **)pointer;
    if (type == HAL_PORT) { /* the pointer leads to a handle, not to the slot */
        pin->pointer = &pin->handle;
        *pointer = &pin->handle;
    }
    return declare(pin, type, dir, (hal_value){.raw = 0}, name);
}

int hal_param_new(const char *name, hal_type_t type, hal_pdir_t dir, volatile void *value, int comp) {
    (void)comp;
    if (!value || (dir != HAL_RO && dir != HAL_RW)) return -EINVAL;
    struct pin *const pin = new_pin();
    hal_type known;
    if (!pin) return -ENOMEM;
    if (!hal_type_of(type, &known) || known == HAL_TYPE_PORT) return -EINVAL;
    pin->value = value;
    memcpy(&pin->last, (const void *)value, width_of(known));
    return declare(pin, type, dir, pin->last, name);
}

#define NAMED(target)                                                                       \
    char text[256];                                                                         \
    va_list arguments;                                                                      \
    va_start(arguments, name);                                                              \
    const int length = vsnprintf(text, sizeof text, name, arguments);                       \
    va_end(arguments);                                                                      \
    return length < 0 || (size_t)length >= sizeof text ? -EINVAL : (target);
#define BY_POINTER(kind, type)                                                                                                        \
    int hal_pin_##kind##_new(const char *name, hal_pdir_t dir, hal_##kind##_t **p, int comp) { return hal_pin_new(name, type, dir, (void **)p, comp); } \
    int hal_pin_##kind##_newf(hal_pdir_t dir, hal_##kind##_t **p, int comp, const char *name, ...) { NAMED(hal_pin_new(text, type, dir, (void **)p, comp)) }
#define BOTH_BY_POINTER(kind, type)                                                                                                   \
    BY_POINTER(kind, type)                                                                                                            \
    int hal_param_##kind##_new(const char *name, hal_pdir_t dir, hal_##kind##_t *v, int comp) { return hal_param_new(name, type, dir, v, comp); } \
    int hal_param_##kind##_newf(hal_pdir_t dir, hal_##kind##_t *v, int comp, const char *name, ...) { NAMED(hal_param_new(text, type, dir, v, comp)) }
BOTH_BY_POINTER(bit, HAL_BIT)
BOTH_BY_POINTER(float, HAL_FLOAT)
BOTH_BY_POINTER(s32, HAL_S32)
BOTH_BY_POINTER(u32, HAL_U32)
BOTH_BY_POINTER(s64, HAL_S64)
BOTH_BY_POINTER(u64, HAL_U64)
BY_POINTER(port, HAL_PORT)

/* A parameter by pointer lives twice: where the runtime reads and writes it, and in the user's variable, which has the width of
 * its type only. Whichever has changed since the last look goes over to the other, before and after each function. */
void look_at_parameters(void) {
    for (struct pin *p = parameters; p; p = p->next) {
        hal_value outside = {.raw = __atomic_load_n(&p->pin.slot->raw, __ATOMIC_RELAXED)}, inside = {.raw = 0};
        const size_t width = width_of(p->type);
        memcpy(&inside, (const void *)p->value, width);
        if (memcmp(&outside, &p->last, width) != 0) {
            memcpy((void *)p->value, &outside, width);
            p->last = (hal_value){.raw = 0};
            memcpy(&p->last, &outside, width);
        } else if (memcmp(&inside, &p->last, width) != 0) {
            __atomic_store_n(&p->pin.slot->raw, inside.raw, __ATOMIC_RELAXED);
            p->last = inside;
        }
    }
}

/* --- component, functions, memory --------------------------------------------------------------------------------------------- */

int hal_init(const char *name) {
    if (!name || strlen(name) > HAL_NAME_LEN) return -EINVAL;
    strcpy(component_name, name);
#ifdef HALCYON_PROGRAM
    host = &program_host;
    const int problem = program_begin(name);
    if (problem < 0) return problem;
#endif
    return component_id;
}
#ifdef HALCYON_PROGRAM
int hal_ready(int comp) { return comp == component_id ? program_ready(true) : -EINVAL; }
int hal_unready(int comp) { return comp == component_id ? program_ready(false) : -EINVAL; }
int hal_exit(int comp) { return comp == component_id ? program_end(), 0 : -EINVAL; }
int halcyon_every(int comp, unsigned every_ms, unsigned timeout_ms) { return comp == component_id ? program_every(every_ms, timeout_ms) : -EINVAL; }
int halcyon_alive(int comp) { return comp == component_id ? program_alive(), 0 : -EINVAL; }
int halcyon_safe(int comp, const char *pin, double value) { return comp == component_id ? program_safe(pin, value) : -EINVAL; }
bool halcyon_connected(int comp) { return comp == component_id && program_connected(); }
#else
int hal_ready(int comp) { return comp == component_id ? 0 : -EINVAL; }
int hal_unready(int comp) { return comp == component_id ? 0 : -EINVAL; }
int hal_exit(int comp) { return comp == component_id ? 0 : -EINVAL; }
#endif
char *hal_comp_name(int comp) { return comp == component_id ? component_name : NULL; }
void *hal_malloc(long size) { return host && size > 0 ? host->allocate(host, (size_t)size, 16) : NULL; }

static void call(void *self, const hal_cycle *cycle) {
    const struct funct *const funct = self;
    funct->code(funct->arg, (long)cycle->period_ns);
}
static void call_with_parameters(void *self, const hal_cycle *cycle) {
    look_at_parameters();
    call(self, cycle);
    look_at_parameters();
}
/* Which of the two it is: known when all parameters are. */
static void call_first(void *self, const hal_cycle *cycle) { (parameters ? call_with_parameters : call)(self, cycle); }

int hal_export_funct(const char *name, hal_funct_t code, void *arg, int uses_fp, int reentrant, int comp) {
    (void)uses_fp, (void)reentrant, (void)comp;
    if (!below(name) || !code || !host) return -EINVAL;
    struct funct *const funct = host->allocate(host, sizeof *funct, _Alignof(struct funct));
    if (!funct) return -ENOMEM;
    *funct = (struct funct){code, arg};
    const hal_function_decl decl = {sizeof decl, 0, below(name), "", call_first, funct, funct};
    return host->function(host, &decl) ? 0 : -EINVAL;
}
int hal_export_functf(hal_funct_t code, void *arg, int uses_fp, int reentrant, int comp, const char *name, ...) {
    NAMED(hal_export_funct(text, code, arg, uses_fp, reentrant, comp))
}

/* --- what a .comp file's instances ask for -------------------------------------------------------------------------------------- */

#ifndef HALCYON_PROGRAM
struct stepped {
    hal_step step;
    void *self;
};
static void step_with_parameters(void *self, const hal_cycle *cycle) {
    const struct stepped *const stepped = self;
    look_at_parameters();
    stepped->step(stepped->self, cycle);
    look_at_parameters();
}

/* Of a .comp file's function: EXTRA_SETUP has run, so its parameters by pointer are known. */
bool halcyon_step(const hal_host *of, hal_function_decl *decl) {
    if (!parameters) return true;
    struct stepped *const stepped = of->allocate(of, sizeof *stepped, _Alignof(struct stepped));
    if (!stepped) return false;
    *stepped = (struct stepped){decl->step, decl->self};
    decl->step = step_with_parameters;
    decl->self = stepped;
    return true;
}

const hal_host *halcyon_host(void) { return host; }

bool halcyon_refuse(const char *name, int result) {
    for (char *at = said; *at; ++at)
        if (*at == '\n') *at = at[1] ? ';' : '\0';
    return *said ? refuse("%s (%s: %s)", said, name, strerror(-result)) : refuse("its %s gave %d (%s)", name, result, strerror(-result));
}

#endif

/* --- life ------------------------------------------------------------------------------------------------------------------------------ */

#if defined HALCYON_PROGRAM && defined HALCYON_OF_COMP /* comp_program.c makes the instances */

bool halcyon_enter(const hal_host *of, const char *instance) {
    (void)of;
    within = instance;
    return true;
}
bool halcyon_refuse(const char *name, int result) {
    rtapi_print_msg(RTAPI_MSG_ERR, "%s: its %s gave %d (%s)\n", component_name, name, result, strerror(-result));
    return false;
}
bool halcyon_leave(bool good) {
    within = "";
    return good;
}
bool halcyon_start(void *self, const hal_host *of) { return (void)self, (void)of, true; }
void halcyon_stop(void *self) { (void)self; }
void halcyon_gone(void) {}
bool halcyon_step(const hal_host *of, hal_function_decl *decl) { return (void)of, (void)decl, true; }

#elif defined HALCYON_PROGRAM /* program.c */

#elif defined HALCYON_OF_COMP /* the instances are made by what `hal compile` has made of the .comp file: comp_instance.h */

static unsigned instances, running;

static struct pin *pins_before, *parameters_before; /* a failed instance takes its own along */

bool halcyon_enter(const hal_host *of, const char *instance) {
    host = of;
    pins_before = pins;
    parameters_before = parameters;
    within = instance;
    if (instances++ == 0) prepare_lines();
    for (const struct halcyon_parameter *const *p = __start_halcyon_parameters; p < __stop_halcyon_parameters; ++p)
        if (!take_parameter(*p)) return false;
    return true;
}

bool halcyon_leave(bool good) {
    if (good) look_at_parameters();
    else pins = pins_before, parameters = parameters_before;
    host = NULL;
    within = "";
    return good;
}

bool halcyon_start(void *self, const hal_host *of) {
    (void)self;
    say_what_was_said();
    if (running > 0) return ++running, true;
    if (!publish_streams(of)) return false;
    start_printing();
    running = 1;
    return true;
}

void halcyon_stop(void *self) {
    (void)self;
    if (--running == 0) stop_printing();
}

void halcyon_gone(void) {
    for (struct pin *p = pins; p; p = p->next)
        if (p->pointer) *p->pointer = p->pin.slot;
    say_what_was_said();
    if (--instances == 0) pins = parameters = NULL;
}

#else

/* Static variables are what they were when the library was loaded, also for a second instance in its place. */
struct memory {
    char *begin;
    size_t bytes;
};
static struct {
    struct memory memory[8];
    size_t count;
    char *copy;
} image;

static int note_memory(struct dl_phdr_info *info, size_t size, void *inside) {
    (void)size;
    bool mine = false;
    for (int i = 0; i < info->dlpi_phnum; ++i) {
        const char *const begin = (const char *)info->dlpi_addr + info->dlpi_phdr[i].p_vaddr;
        mine = mine || (info->dlpi_phdr[i].p_type == PT_LOAD && (const char *)inside >= begin && (const char *)inside < begin + info->dlpi_phdr[i].p_memsz);
    }
    if (!mine) return 0;
    const char *read_only = NULL; /* what the loader made so after relocating: it stands at the begin of a writable part */
    for (int i = 0; i < info->dlpi_phnum; ++i)
        if (info->dlpi_phdr[i].p_type == PT_GNU_RELRO) read_only = (const char *)info->dlpi_addr + info->dlpi_phdr[i].p_vaddr + info->dlpi_phdr[i].p_memsz;
    const uintptr_t page = (uintptr_t)sysconf(_SC_PAGESIZE);
    for (int i = 0; i < info->dlpi_phnum; ++i) {
        if (info->dlpi_phdr[i].p_type != PT_LOAD || !(info->dlpi_phdr[i].p_flags & PF_W) || image.count == sizeof image.memory / sizeof *image.memory) continue;
        char *begin = (char *)info->dlpi_addr + info->dlpi_phdr[i].p_vaddr;
        char *const end = begin + info->dlpi_phdr[i].p_memsz;
        if (read_only > begin && read_only <= end) begin = (char *)(((uintptr_t)read_only + page - 1) / page * page);
        if (begin < end) image.memory[image.count++] = (struct memory){begin, (size_t)(end - begin)};
    }
    return 1;
}

__attribute__((destructor)) static void forget(void) { free((char *)image.copy); }

static bool remember_or_restore(void) {
    if (!image.copy) {
        dl_iterate_phdr(note_memory, &image);
        size_t bytes = 0;
        for (size_t i = 0; i < image.count; ++i) bytes += image.memory[i].bytes;
        char *const copy = malloc(bytes);
        if (!copy) return false;
        image.copy = copy;
        for (size_t i = 0, at = 0; i < image.count; at += image.memory[i++].bytes) memcpy(copy + at, image.memory[i].begin, image.memory[i].bytes);
        return true;
    }
    struct memory memory[8];
    const size_t count = image.count;
    const char *const copy = image.copy;
    memcpy(memory, image.memory, sizeof memory);
    for (size_t i = 0, at = 0; i < count; at += memory[i++].bytes) memcpy(memory[i].begin, copy + at, memory[i].bytes);
    return true;
}

static bool create(const hal_host *of, void *unused) {
    (void)unused;
    if (!remember_or_restore()) return of->fail(of, "out of memory"), false;
    host = of;
    prepare_lines();
    bool good = true;
    for (const struct halcyon_parameter *const *p = __start_halcyon_parameters; good && p < __stop_halcyon_parameters; ++p) good = take_parameter(*p);
    if (good) {
        const int result = rtapi_app_main();
        if (result < 0) {
            for (char *at = said; *at; ++at) /* one line; the last end of line goes */
                if (*at == '\n') *at = at[1] ? ';' : '\0';
            good = *said ? refuse("%s (rtapi_app_main: %s)", said, strerror(-result)) : refuse("rtapi_app_main failed: %s", strerror(-result));
        }
    }
    if (good) look_at_parameters();
    host = NULL;
    return good;
}

static bool start(void *self, const hal_host *of) {
    (void)self;
    say_what_was_said();
    if (!publish_streams(of)) return false;
    start_printing();
    return true;
}

static void stop(void *self) {
    (void)self;
    stop_printing();
}

static void destroy(void *self) {
    (void)self;
    for (struct pin *p = pins; p; p = p->next) /* what the user's pointers led to may be gone */
        if (p->pointer) *p->pointer = p->pin.slot;
    if (rtapi_app_exit) rtapi_app_exit();
    say_what_was_said();
}

HAL_EXPORT hal_component hal_plugin = {
    sizeof(hal_component), HAL_ABI_MAJOR, HAL_ABI_MINOR, HALCYON_COMPONENT, "a LinuxCNC component in C", "",
    HAL_COMPONENT_SINGLETON | HAL_COMPONENT_WHOLE_NAMES | HAL_COMPONENT_LOOSE_PINS, 1, sizeof(void *), _Alignof(void *), create, start, stop, destroy};

__attribute__((constructor)) static void take_notes(void) {
    static char doc[1024];
    for (const struct halcyon_note *const *note = __start_halcyon_notes; note < __stop_halcyon_notes; ++note) {
        if (strcmp((*note)->key, "description") == 0) hal_plugin.summary = (*note)->text;
        else if (strlen(doc) + strlen((*note)->key) + strlen((*note)->text) + 8 < sizeof doc)
            sprintf(doc + strlen(doc), "%s%s: %s", *doc ? "\n\n" : "", (*note)->key, (*note)->text);
    }
    hal_plugin.doc = doc;
}
#endif
