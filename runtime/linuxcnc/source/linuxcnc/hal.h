/* SPDX-License-Identifier: MIT */
/*
 * LinuxCNC's HAL interface for real-time components, as its manual pages (section 3, hal) describe
 * it, over Halcyon's own: both the handles with getters and setters, and the older pointers. Bodies
 * are in the sources beside this file, which `hal compile FILE.c` compiles with the user's file.
 *
 * A handle or a pin's pointer leads to the slot where the value is; the runtime sets it when the
 * pin is linked. So it must stay where it was declared: in memory of hal_malloc() or a static
 * variable.
 */
#ifndef HAL_H
#define HAL_H
#include "rtapi.h"

#ifdef __cplusplus
extern "C" {
#endif

#define HAL_NAME_LEN 55
#define HAL_STREAM_MAX_PINS 21

typedef enum {
    HAL_BOOL = 1,
    HAL_REAL,
    HAL_S32,
    HAL_U32,
    HAL_PORT,
    HAL_SINT,
    HAL_UINT,
    HAL_BIT = HAL_BOOL,
    HAL_FLOAT = HAL_REAL,
    HAL_S64 = HAL_SINT,
    HAL_U64 = HAL_UINT
} hal_type_t;
typedef enum {
    HAL_IN = 16,
    HAL_OUT = 32,
    HAL_IO = HAL_IN | HAL_OUT,
    HAL_RO = 64,
    HAL_RW = HAL_RO | 128
} hal_pdir_t;
typedef hal_pdir_t hal_pin_dir_t;
typedef hal_pdir_t hal_param_dir_t;

/* --- values by handle --- */

#define HALCYON_SLOT(type, member)                       \
    struct __attribute__((may_alias)) halcyon_##member { \
        type value;                                      \
    }
HALCYON_SLOT(rtapi_bool, bool);
HALCYON_SLOT(rtapi_real, real);
HALCYON_SLOT(rtapi_sint, sint);
HALCYON_SLOT(rtapi_uint, uint);
HALCYON_SLOT(void*, port);
#undef HALCYON_SLOT
typedef volatile struct halcyon_bool* hal_bool_t;
typedef volatile struct halcyon_real* hal_real_t;
typedef volatile struct halcyon_sint* hal_sint_t;
typedef volatile struct halcyon_uint* hal_uint_t;
typedef volatile struct halcyon_port* hal_port_t;
typedef union hal_refs_u {
    hal_bool_t b;
    hal_sint_t s;
    hal_uint_t u;
    hal_real_t r;
    hal_port_t p;
} hal_refs_u;
typedef hal_refs_u hal_refs_t;

static inline rtapi_bool hal_get_bool(hal_bool_t from) { return from->value; }
static inline rtapi_real hal_get_real(hal_real_t from) { return from->value; }
static inline rtapi_sint hal_get_sint(hal_sint_t from) { return from->value; }
static inline rtapi_uint hal_get_uint(hal_uint_t from) { return from->value; }
static inline rtapi_s32 hal_get_si32(hal_sint_t from) { return (rtapi_s32)from->value; }
static inline rtapi_u32 hal_get_ui32(hal_uint_t from) { return (rtapi_u32)from->value; }
static inline rtapi_s32 hal_get_si32_clamped(hal_sint_t from) {
    const rtapi_sint value = from->value;
    if (value < RTAPI_INT32_MIN) return RTAPI_INT32_MIN;
    if (value > RTAPI_INT32_MAX) return RTAPI_INT32_MAX;
    return (rtapi_s32)value;
}
static inline rtapi_u32 hal_get_ui32_clamped(hal_uint_t from) {
    const rtapi_uint value = from->value;
    return value > RTAPI_UINT32_MAX ? RTAPI_UINT32_MAX : (rtapi_u32)value;
}
static inline rtapi_bool hal_set_bool(hal_bool_t to, rtapi_bool value) { return to->value = value; }
static inline rtapi_real hal_set_real(hal_real_t to, rtapi_real value) { return to->value = value; }
static inline rtapi_sint hal_set_sint(hal_sint_t to, rtapi_sint value) { return to->value = value; }
static inline rtapi_uint hal_set_uint(hal_uint_t to, rtapi_uint value) { return to->value = value; }
static inline rtapi_s32 hal_set_si32(hal_sint_t to, rtapi_s32 value) {
    to->value = value;
    return value;
}
static inline rtapi_u32 hal_set_ui32(hal_uint_t to, rtapi_u32 value) {
    to->value = value;
    return value;
}

#define HALCYON_NAMED(place) __attribute__((format(printf, place, place + 1)))
int hal_pin_new_bool(int comp, hal_pdir_t dir, hal_bool_t* handle, rtapi_bool initial,
                     const char* name, ...) HALCYON_NAMED(5);
int hal_pin_new_real(int comp, hal_pdir_t dir, hal_real_t* handle, rtapi_real initial,
                     const char* name, ...) HALCYON_NAMED(5);
int hal_pin_new_sint(int comp, hal_pdir_t dir, hal_sint_t* handle, rtapi_sint initial,
                     const char* name, ...) HALCYON_NAMED(5);
int hal_pin_new_uint(int comp, hal_pdir_t dir, hal_uint_t* handle, rtapi_uint initial,
                     const char* name, ...) HALCYON_NAMED(5);
int hal_pin_new_si32(int comp, hal_pdir_t dir, hal_sint_t* handle, rtapi_s32 initial,
                     const char* name, ...) HALCYON_NAMED(5);
int hal_pin_new_ui32(int comp, hal_pdir_t dir, hal_uint_t* handle, rtapi_u32 initial,
                     const char* name, ...) HALCYON_NAMED(5);
int hal_pin_new_port(int comp, hal_pdir_t dir, hal_port_t* handle, const char* name, ...)
    HALCYON_NAMED(4);
int hal_param_new_bool(int comp, hal_pdir_t dir, hal_bool_t* handle, rtapi_bool initial,
                       const char* name, ...) HALCYON_NAMED(5);
int hal_param_new_real(int comp, hal_pdir_t dir, hal_real_t* handle, rtapi_real initial,
                       const char* name, ...) HALCYON_NAMED(5);
int hal_param_new_sint(int comp, hal_pdir_t dir, hal_sint_t* handle, rtapi_sint initial,
                       const char* name, ...) HALCYON_NAMED(5);
int hal_param_new_uint(int comp, hal_pdir_t dir, hal_uint_t* handle, rtapi_uint initial,
                       const char* name, ...) HALCYON_NAMED(5);
int hal_param_new_si32(int comp, hal_pdir_t dir, hal_sint_t* handle, rtapi_s32 initial,
                       const char* name, ...) HALCYON_NAMED(5);
int hal_param_new_ui32(int comp, hal_pdir_t dir, hal_uint_t* handle, rtapi_u32 initial,
                       const char* name, ...) HALCYON_NAMED(5);
int hal_param_new_fake(int comp, hal_refs_u* handle); /* a value without a name */

/* --- values by pointer, the older way --- */

typedef bool hal_bool;
typedef double real_t;
typedef rtapi_u64 ireal_t;
typedef volatile bool hal_bit_t;
typedef volatile rtapi_s32 hal_s32_t;
typedef volatile rtapi_u32 hal_u32_t;
typedef volatile rtapi_s64 hal_s64_t;
typedef volatile rtapi_u64 hal_u64_t;
typedef volatile double hal_float_t;

#define HALCYON_POINTERS(type)                                                                     \
    int hal_pin_##type##_new(const char* name, hal_pdir_t dir, hal_##type##_t** pointer,           \
                             int comp);                                                            \
    int hal_pin_##type##_newf(hal_pdir_t dir, hal_##type##_t** pointer, int comp,                  \
                              const char* name, ...) HALCYON_NAMED(4);                             \
    int hal_param_##type##_new(const char* name, hal_pdir_t dir, hal_##type##_t* value, int comp); \
    int hal_param_##type##_newf(hal_pdir_t dir, hal_##type##_t* value, int comp, const char* name, \
                                ...) HALCYON_NAMED(4);
HALCYON_POINTERS(bit)
HALCYON_POINTERS(float)
HALCYON_POINTERS(s32)
HALCYON_POINTERS(u32)
HALCYON_POINTERS(s64)
HALCYON_POINTERS(u64)
#undef HALCYON_POINTERS
int hal_pin_port_new(const char* name, hal_pdir_t dir, hal_port_t** pointer, int comp);
int hal_pin_port_newf(hal_pdir_t dir, hal_port_t** pointer, int comp, const char* name, ...)
    HALCYON_NAMED(4);
int hal_pin_new(const char* name, hal_type_t type, hal_pdir_t dir, void** pointer, int comp);
int hal_param_new(const char* name, hal_type_t type, hal_pdir_t dir, volatile void* value,
                  int comp);

/* --- component, functions, memory: all [setup] --- */

typedef void (*hal_funct_t)(void* arg, long period);
int hal_init(const char* name);
int hal_ready(int comp);
int hal_unready(int comp);
int hal_exit(int comp);
char* hal_comp_name(int comp);
void* hal_malloc(long size); /* cleared; lives as long as the component */
int hal_export_funct(const char* name, hal_funct_t code, void* arg, int uses_fp, int reentrant,
                     int comp);
int hal_export_functf(hal_funct_t code, void* arg, int uses_fp, int reentrant, int comp,
                      const char* name, ...) HALCYON_NAMED(6);

/* --- programs of Halcyon: nothing of LinuxCNC's. [any] thread of a program; 0, or a negative errno --- */

#ifdef HALCYON_PROGRAM
/* Declares that the program calls halcyon_alive() at least every so many milliseconds. When it has
 * not for `timeout_ms` longer, `show comp` shows "not responding" and its outputs take their
 * declared values, until it calls again. 0: no longer. */
int halcyon_every(int comp, unsigned every_ms, unsigned timeout_ms);
int halcyon_alive(int comp);
/* Declares what an output takes when the program is dead or does not respond; without it, it keeps
 * its value. */
int halcyon_safe(int comp, const char* pin, double value);
/* Whether the machine is there. While it is not, inputs keep their last values. */
bool halcyon_connected(int comp);
#endif

/* --- byte streams: [realtime] --- */

bool hal_port_read(hal_port_t port, char* to, unsigned count);
bool hal_port_peek(hal_port_t port, char* to, unsigned count);
bool hal_port_peek_commit(hal_port_t port, unsigned count);
unsigned hal_port_readable(hal_port_t port);
void hal_port_clear(hal_port_t port);
bool hal_port_write(hal_port_t port, const char* from, unsigned count);
unsigned hal_port_writable(hal_port_t port);
unsigned hal_port_buffer_size(hal_port_t port);
#if !defined(__cplusplus) && !defined(HALCYON_INSIDE)
/* A port is given by its handle or by a pointer to that: components do both. */
#define HALCYON_PORT(port) _Generic((port), hal_port_t: (port), default: *(hal_port_t const*)(port))
#define hal_port_read(port, to, count) hal_port_read(HALCYON_PORT(port), to, count)
#define hal_port_peek(port, to, count) hal_port_peek(HALCYON_PORT(port), to, count)
#define hal_port_peek_commit(port, count) hal_port_peek_commit(HALCYON_PORT(port), count)
#define hal_port_readable(port) hal_port_readable(HALCYON_PORT(port))
#define hal_port_clear(port) hal_port_clear(HALCYON_PORT(port))
#define hal_port_write(port, from, count) hal_port_write(HALCYON_PORT(port), from, count)
#define hal_port_writable(port) hal_port_writable(HALCYON_PORT(port))
#define hal_port_buffer_size(port) hal_port_buffer_size(HALCYON_PORT(port))
#endif

/* --- streams of records between a component and a program --- */

typedef union hal_stream_data {
    rtapi_bool b;
    rtapi_real f, r;
    rtapi_s32 s;
    rtapi_u32 u;
    rtapi_s64 l;
    rtapi_u64 k;
} hal_stream_data_u;
typedef struct hal_stream_handle {
    struct halcyon_stream* fifo;
} hal_stream_t;

int hal_stream_create(hal_stream_t* stream, int comp, int key, unsigned depth,
                      const char* types); /* [setup] */
void hal_stream_destroy(hal_stream_t* stream); /* [setup] */
int hal_stream_attach(hal_stream_t* stream, int comp, int key,
                      const char* types); /* -ENOENT: programs outside come by socket */
int hal_stream_detach(hal_stream_t* stream);
int hal_stream_element_count(hal_stream_t* stream);
hal_type_t hal_stream_element_type(hal_stream_t* stream, int index);
int hal_stream_read(hal_stream_t* stream, hal_stream_data_u* to, unsigned* number);
bool hal_stream_readable(hal_stream_t* stream);
int hal_stream_write(hal_stream_t* stream, hal_stream_data_u* from);
bool hal_stream_writable(hal_stream_t* stream);
int hal_stream_depth(hal_stream_t* stream);
int hal_stream_maxdepth(hal_stream_t* stream);
int hal_stream_num_underruns(hal_stream_t* stream);
int hal_stream_num_overruns(hal_stream_t* stream);

#ifdef __cplusplus
}
#endif
#endif
