/* SPDX-License-Identifier: MIT */
/* rtapi_string(3), rtapi_strlcpy(3). */
#ifndef RTAPI_STRING_H
#define RTAPI_STRING_H
#include "rtapi_gfp.h"
#include <stdlib.h>
#include <string.h>

/* Copies what fits and ends it; returns how long it would have been. */
static inline size_t rtapi_strlcpy(char* to, const char* from, size_t size) {
    const size_t length = strlen(from);
    if (size > 0) {
        const size_t fits = length < size ? length : size - 1;
        memcpy(to, from, fits);
        to[fits] = '\0';
    }
    return length;
}
static inline size_t rtapi_strlcat(char* to, const char* from, size_t size) {
    const size_t used = strnlen(to, size);
    return used + rtapi_strlcpy(to + used, from, size - used);
}
/* The size of an array; of a pointer it does not compile. */
#define HALCYON_ARRAY_SIZE(array)                                          \
    (sizeof(array) + 0 * sizeof(char[1 - 2 * __builtin_types_compatible_p( \
                                                 __typeof__(array), __typeof__(&(array)[0]))]))
#define rtapi_strxcpy(to, from) rtapi_strlcpy((to), (from), HALCYON_ARRAY_SIZE(to))
#define rtapi_strxcat(to, from) rtapi_strlcat((to), (from), HALCYON_ARRAY_SIZE(to))

static inline char* rtapi_kstrdup(const char* text, rtapi_gfp_t how) {
    (void)how;
    return strdup(text);
}

char** rtapi_argv_split(rtapi_gfp_t how, const char* text,
                        int* count); /* words between blanks; NULL: no memory */
void rtapi_argv_free(char** words);
#endif
