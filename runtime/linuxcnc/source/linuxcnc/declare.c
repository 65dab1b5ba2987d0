/* SPDX-License-Identifier: MIT */
/* hal.h: pins and parameters, by handle and by pointer, and functions. */
#include <stdio.h>
#include <string.h>

#include "inside.h"

struct pin {
    hal_pin pin;
    hal_value* handle;    /* of a port by pointer: what the pointer points to */
    hal_value** pointer;  /* the user's, or &handle */
    volatile void* value; /* of a parameter by pointer: the user's variable */
    hal_value last;       /* of such a parameter: what both had when they were last compared */
    hal_type type;
    int number;           /* of a port of a program of LinuxCNC's */
    struct pin* next;
};
struct funct {
    hal_funct_t code;
    void* arg;
};

static struct pin *pins, *parameters; /* parameters: those by pointer, a list of their own */
static struct pin *marked_pins, *marked_parameters;
static const char* instance_name =
    ""; /* of a .comp file: the name below which the runtime takes names */

void halcyon_set_instance(const char* name) { instance_name = name; }

/* --- pins and parameters --- */

static bool hal_type_of(hal_type_t type, hal_type* to) {
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

static size_t width_of(hal_type type) {
    switch (type) {
    case HAL_TYPE_BIT: return 1;
    case HAL_TYPE_S32:
    case HAL_TYPE_U32: return 4;
    default: return 8;
    }
}

static struct pin* new_pin(int comp) {
    const hal_host* const host = halcyon_host_of(comp);
    struct pin* const pin = host ? host->allocate(host, sizeof *pin, _Alignof(struct pin)) : NULL;
    if (!pin) return NULL;
    pin->pin.slot = &pin->pin.own;
    return pin;
}

/* Returns the name as the runtime takes it; NULL when it is not below the instance's. */
static const char* local_name(const char* name) {
    const size_t length = strlen(instance_name);
    if (!name || !*name) return NULL;
    if (length == 0) return name;
    if (strncmp(name, instance_name, length) != 0) return NULL;
    if (name[length] == '.') return name + length + 1;
    return name[length] == '\0' ? name + length : NULL;
}

static int declare(int comp, struct pin* pin, hal_type_t type, hal_pdir_t dir, hal_value initial,
                   const char* name) {
    hal_pin_decl decl = {.size = sizeof decl,
                         .name = local_name(name),
                         .doc = "",
                         .unit = "",
                         .initial = initial,
                         .pointer = pin->pointer};
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
    const hal_host* const host = halcyon_host_of(comp);
    if (!host->pin(host, &decl, &pin->pin)) return -EINVAL;
    if (pin->pointer) {
        *pin->pointer = pin->pin.slot;
    }
    struct pin** const list = pin->value ? &parameters : &pins;
    pin->next = *list;
    *list = pin;
    return 0;
}

static int by_handle(int comp, hal_type_t type, bool parameter, hal_pdir_t dir, void* handle,
                     hal_value initial, const char* format, va_list arguments) {
    if (!handle || (dir == HAL_RO || dir == HAL_RW) != parameter) return -EINVAL;
    char name[256];
    const int length = vsnprintf(name, sizeof name, format, arguments);
    if (length < 0 || (size_t)length >= sizeof name) return -EINVAL;
    struct pin* const pin = new_pin(comp);
    if (!pin) return -ENOMEM;
    pin->pointer = handle;
    return declare(comp, pin, type, dir, initial, name);
}

#define BY_HANDLE(function, type, hal_kind, parameter, member, ctype)                            \
    int function(int comp, hal_pdir_t dir, type* handle, ctype initial, const char* name, ...) { \
        hal_value value = {.raw = 0};                                                            \
        value.member = initial;                                                                  \
        va_list arguments;                                                                       \
        va_start(arguments, name);                                                               \
        const int result =                                                                       \
            by_handle(comp, hal_kind, parameter, dir, handle, value, name, arguments);           \
        va_end(arguments);                                                                       \
        return result;                                                                           \
    }
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored \
    "-Wvarargs" /* bool is promoted when passed, but it is not the last argument before them */
BY_HANDLE(hal_pin_new_bool, hal_bool_t, HAL_BOOL, false, bit, rtapi_bool)
BY_HANDLE(hal_param_new_bool, hal_bool_t, HAL_BOOL, true, bit, rtapi_bool)
BY_HANDLE(hal_pin_new_real, hal_real_t, HAL_REAL, false, real, rtapi_real)
BY_HANDLE(hal_param_new_real, hal_real_t, HAL_REAL, true, real, rtapi_real)
BY_HANDLE(hal_pin_new_sint, hal_sint_t, HAL_SINT, false, s64, rtapi_sint)
BY_HANDLE(hal_param_new_sint, hal_sint_t, HAL_SINT, true, s64, rtapi_sint)
BY_HANDLE(hal_pin_new_uint, hal_uint_t, HAL_UINT, false, u64, rtapi_uint)
BY_HANDLE(hal_param_new_uint, hal_uint_t, HAL_UINT, true, u64, rtapi_uint)
BY_HANDLE(hal_pin_new_si32, hal_sint_t, HAL_S32, false, s64,
          rtapi_s32) /* the whole slot: a 64-bit getter sees the same */
BY_HANDLE(hal_param_new_si32, hal_sint_t, HAL_S32, true, s64, rtapi_s32)
BY_HANDLE(hal_pin_new_ui32, hal_uint_t, HAL_U32, false, u64, rtapi_u32)
BY_HANDLE(hal_param_new_ui32, hal_uint_t, HAL_U32, true, u64, rtapi_u32)
#pragma GCC diagnostic pop

int hal_pin_new_port(int comp, hal_pdir_t dir, hal_port_t* handle, const char* name, ...) {
    va_list arguments;
    va_start(arguments, name);
    const int result =
        by_handle(comp, HAL_PORT, false, dir, handle, (hal_value){.raw = 0}, name, arguments);
    va_end(arguments);
    return result;
}

int hal_param_new_fake(int comp, hal_refs_u* handle) {
    struct pin* const pin = new_pin(comp);
    if (!pin) return -ENOMEM;
    handle->p = (hal_port_t)(void*)&pin->pin.own;
    return 0;
}

int hal_pin_new(const char* name, hal_type_t type, hal_pdir_t dir, void** pointer, int comp) {
    if (!pointer || dir == HAL_RO || dir == HAL_RW) return -EINVAL;
    struct pin* const pin = new_pin(comp);
    if (!pin) return -ENOMEM;
    pin->pointer = (hal_value**)pointer;
#ifdef HALCYON_LINUXCNC_PROGRAMS
    if (type == HAL_PORT) { /* compiled for LinuxCNC 2.9: the pointer leads to a number */
        pin->pointer = NULL;
        const int result = declare(comp, pin, type, dir, (hal_value){.raw = 0}, name);
        if (result == 0) {
            pin->number = halcyon_number_of_port(&pin->pin);
            *pointer = &pin->number;
        }
        return result;
    }
#endif
    if (type == HAL_PORT) { /* the pointer leads to a handle, not to the slot */
        pin->pointer = &pin->handle;
        *pointer = &pin->handle;
    }
    return declare(comp, pin, type, dir, (hal_value){.raw = 0}, name);
}

int hal_param_new(const char* name, hal_type_t type, hal_pdir_t dir, volatile void* value,
                  int comp) {
    if (!value || (dir != HAL_RO && dir != HAL_RW)) return -EINVAL;
    struct pin* const pin = new_pin(comp);
    hal_type known;
    if (!pin) return -ENOMEM;
    if (!hal_type_of(type, &known) || known == HAL_TYPE_PORT) return -EINVAL;
    pin->value = value;
    memcpy(&pin->last, (const void*)value, width_of(known));
    return declare(comp, pin, type, dir, pin->last, name);
}

#define NAMED(target)                                                 \
    char text[256];                                                   \
    va_list arguments;                                                \
    va_start(arguments, name);                                        \
    const int length = vsnprintf(text, sizeof text, name, arguments); \
    va_end(arguments);                                                \
    return length < 0 || (size_t)length >= sizeof text ? -EINVAL : (target);
#define BY_POINTER(kind, type)                                                                 \
    int hal_pin_##kind##_new(const char* name, hal_pdir_t dir, hal_##kind##_t** p, int comp) { \
        return hal_pin_new(name, type, dir, (void**)p, comp);                                  \
    }                                                                                          \
    int hal_pin_##kind##_newf(hal_pdir_t dir, hal_##kind##_t** p, int comp, const char* name,  \
                              ...) {                                                           \
        NAMED(hal_pin_new(text, type, dir, (void**)p, comp))                                   \
    }
#define BOTH_BY_POINTER(kind, type)                                                             \
    BY_POINTER(kind, type)                                                                      \
    int hal_param_##kind##_new(const char* name, hal_pdir_t dir, hal_##kind##_t* v, int comp) { \
        return hal_param_new(name, type, dir, v, comp);                                         \
    }                                                                                           \
    int hal_param_##kind##_newf(hal_pdir_t dir, hal_##kind##_t* v, int comp, const char* name,  \
                                ...) {                                                          \
        NAMED(hal_param_new(text, type, dir, v, comp))                                          \
    }
BOTH_BY_POINTER(bit, HAL_BIT)
BOTH_BY_POINTER(float, HAL_FLOAT)
BOTH_BY_POINTER(s32, HAL_S32)
BOTH_BY_POINTER(u32, HAL_U32)
BOTH_BY_POINTER(s64, HAL_S64)
BOTH_BY_POINTER(u64, HAL_U64)
BY_POINTER(port, HAL_PORT)

/* A parameter by pointer lives twice: where the runtime reads and writes it, and in the user's
 * variable, which has the width of its type only. Whichever has changed since they were last
 * compared is copied to the other, before and after each function. */
void halcyon_sync_parameters(void) {
    for (struct pin* p = parameters; p; p = p->next) {
        hal_value outside = {.raw = __atomic_load_n(&p->pin.slot->raw, __ATOMIC_RELAXED)};

        hal_value inside = {.raw = 0};
        const size_t width = width_of(p->type);
        memcpy(&inside, (const void*)p->value, width);
        if (memcmp(&outside, &p->last, width) != 0) {
            memcpy((void*)p->value, &outside, width);
            p->last = (hal_value){.raw = 0};
            memcpy(&p->last, &outside, width);
        } else if (memcmp(&inside, &p->last, width) != 0) {
            __atomic_store_n(&p->pin.slot->raw, inside.raw, __ATOMIC_RELAXED);
            p->last = inside;
        }
    }
}

/* --- the lists --- */

void halcyon_mark_pins(void) {
    marked_pins = pins;
    marked_parameters = parameters;
}
void halcyon_drop_marked_pins(void) {
    pins = marked_pins;
    parameters = marked_parameters;
}
void halcyon_drop_pins(void) { pins = parameters = NULL; }
void halcyon_detach_pins(void) {
    for (struct pin* p = pins; p; p = p->next) {
        if (p->pointer) {
            *p->pointer = p->pin.slot;
        }
    }
}

/* --- functions --- */

static void call(void* self, const hal_cycle* cycle) {
    const struct funct* const funct = self;
    funct->code(funct->arg, (long)cycle->period_ns);
}
static void call_with_parameters(void* self, const hal_cycle* cycle) {
    halcyon_sync_parameters();
    call(self, cycle);
    halcyon_sync_parameters();
}
/* Which of the two applies is known once all parameters are declared. */
static void call_first(void* self, const hal_cycle* cycle) {
    (parameters ? call_with_parameters : call)(self, cycle);
}

int hal_export_funct(const char* name, hal_funct_t code, void* arg, int uses_fp, int reentrant,
                     int comp) {
    (void)uses_fp, (void)reentrant, (void)comp;
    if (!local_name(name) || !code || !halcyon_current_host) return -EINVAL;
    struct funct* const funct =
        halcyon_current_host->allocate(halcyon_current_host, sizeof *funct, _Alignof(struct funct));
    if (!funct) return -ENOMEM;
    *funct = (struct funct){code, arg};
    const hal_function_decl decl = {sizeof decl, 0,   local_name(name), "", call_first, funct,
                                    funct,       NULL};
    return halcyon_current_host->function(halcyon_current_host, &decl) ? 0 : -EINVAL;
}
int hal_export_functf(hal_funct_t code, void* arg, int uses_fp, int reentrant, int comp,
                      const char* name, ...) {
    NAMED(hal_export_funct(text, code, arg, uses_fp, reentrant, comp))
}

struct stepped {
    hal_step step;
    void* self;
};
static void step_with_parameters(void* self, const hal_cycle* cycle) {
    const struct stepped* const stepped = self;
    halcyon_sync_parameters();
    stepped->step(stepped->self, cycle);
    halcyon_sync_parameters();
}

/* Called for each function of a .comp file, not in a program. EXTRA_SETUP has run, so the
 * parameters by pointer are known. */
bool halcyon_step(const hal_host* of, hal_function_decl* decl) {
    if (!parameters) return true;
    struct stepped* const stepped = of->allocate(of, sizeof *stepped, _Alignof(struct stepped));
    if (!stepped) return false;
    *stepped = (struct stepped){decl->step, decl->self};
    decl->step = step_with_parameters;
    decl->self = stepped;
    return true;
}
