/* SPDX-License-Identifier: MIT */
/*
 * LinuxCNC's real-time interface for components, as its manual pages (section 3, rtapi) describe
 * it, over Halcyon's own. Bodies are in the sources beside this file, which `hal compile FILE.c`
 * compiles with the user's file.
 */
#ifndef RTAPI_H
#define RTAPI_H
#include <errno.h>
#include <stdarg.h>
#include <stddef.h>

#include "rtapi_bool.h"
#include "rtapi_math64.h"
#include "rtapi_stdint.h"

#if !defined RTAPI && !defined ULAPI
#define RTAPI 1
#endif

#ifdef __cplusplus
extern "C" {
#endif

#define RTAPI_NAME_LEN 31

typedef enum {
    RTAPI_MSG_NONE,
    RTAPI_MSG_ERR,
    RTAPI_MSG_WARN,
    RTAPI_MSG_INFO,
    RTAPI_MSG_DBG,
    RTAPI_MSG_ALL
} msg_level_t;

/* [any] In a cycle the text waits in a queue (128 lines of 240 characters) and an ordinary thread
 * prints it. */
void rtapi_print(const char* format, ...) __attribute__((format(printf, 1, 2)));
void rtapi_print_msg(msg_level_t level, const char* format, ...)
    __attribute__((format(printf, 2, 3)));
int rtapi_snprintf(char* to, unsigned long size, const char* format, ...)
    __attribute__((format(printf, 3, 4)));
int rtapi_vsnprintf(char* to, unsigned long size, const char* format, va_list arguments);
int rtapi_set_msg_level(int level);
int rtapi_get_msg_level(void);
typedef void (*rtapi_msg_handler_t)(msg_level_t level, const char* format, va_list arguments);
void rtapi_set_msg_handler(rtapi_msg_handler_t handler);
rtapi_msg_handler_t rtapi_get_msg_handler(void);

long long rtapi_get_time(void); /* [any] ns of CLOCK_MONOTONIC */
long long rtapi_get_clocks(void); /* [any] the same: the unit is not promised */
void rtapi_delay(long ns); /* [any] spins; rtapi_delay_max() at most */
long rtapi_delay_max(void);

int rtapi_init(const char* name);
int rtapi_exit(int module);
int rtapi_is_kernelspace(void);
int rtapi_is_realtime(void);
int rtapi_prio_highest(void);
int rtapi_prio_lowest(void);
int rtapi_prio_next_higher(int priority);
int rtapi_prio_next_lower(int priority);
/* 0 asks; periods are made by `loadrt threads` and newthread */
long rtapi_clock_set_period(long ns);

/* --- module parameters: load arguments, found in a section of the plugin --- */

struct halcyon_parameter {
    const char *name, *doc;
    void* place;
    int type; /* 'i' int, 'l' long, 's' char * */
    int max; /* elements of an array; 0: not an array */
};
struct halcyon_note {
    const char *key, *text;
};

#define HALCYON_IN_SECTION(section_name) __attribute__((used, section(section_name)))
#define HALCYON_PARAMETER(var, doc, type, max)                                                     \
    static const struct halcyon_parameter halcyon_parameter_##var = {#var, doc, (void*)&var, type, \
                                                                     max};                         \
    static const struct halcyon_parameter* const halcyon_parameter_entry_##var HALCYON_IN_SECTION( \
        "halcyon_parameters") = &halcyon_parameter_##var;
#define HALCYON_PASTE_(a, b) a##b
#define HALCYON_PASTE(a, b) HALCYON_PASTE_(a, b)
#define HALCYON_NOTE_(number, key, text)                                                 \
    static const struct halcyon_note HALCYON_PASTE(halcyon_note_, number) = {key, text}; \
    static const struct halcyon_note* const HALCYON_PASTE(halcyon_note_entry_, number)   \
        HALCYON_IN_SECTION("halcyon_notes") = &HALCYON_PASTE(halcyon_note_, number);
#define HALCYON_NOTE(key, text) HALCYON_NOTE_(__COUNTER__, key, text)

#define RTAPI_MP_INT(var, doc) HALCYON_PARAMETER(var, doc, 'i', 0)
#define RTAPI_MP_LONG(var, doc) HALCYON_PARAMETER(var, doc, 'l', 0)
#define RTAPI_MP_STRING(var, doc) HALCYON_PARAMETER(var, doc, 's', 0)
#define RTAPI_MP_ARRAY_INT(var, num, doc) HALCYON_PARAMETER(var, doc, 'i', num)
#define RTAPI_MP_ARRAY_LONG(var, num, doc) HALCYON_PARAMETER(var, doc, 'l', num)
#define RTAPI_MP_ARRAY_STRING(var, num, doc) HALCYON_PARAMETER(var, doc, 's', num)
#define MODULE_AUTHOR(text) HALCYON_NOTE("author", text)
#define MODULE_DESCRIPTION(text) HALCYON_NOTE("description", text)
#define MODULE_LICENSE(text) HALCYON_NOTE("license", text)
#define MODULE_INFO(key, text) HALCYON_NOTE(#key, text)
#define EXPORT_SYMBOL(name)
#define EXPORT_SYMBOL_GPL(name)
#define EXPORT_FUNCTION(name)

#ifdef __cplusplus
}
#endif
#endif
