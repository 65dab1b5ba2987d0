/* SPDX-License-Identifier: MIT */
/* rtapi_slab(3): while a component is set up and taken down, never in a cycle. */
#ifndef RTAPI_SLAB_H
#define RTAPI_SLAB_H
#include "rtapi_gfp.h"
#include <stdlib.h>

static inline void* rtapi_kmalloc(size_t size, rtapi_gfp_t how) {
    (void)how;
    return malloc(size);
}
static inline void* rtapi_kzalloc(size_t size, rtapi_gfp_t how) {
    (void)how;
    return calloc(1, size);
}
static inline void* rtapi_kcalloc(size_t count, size_t size, rtapi_gfp_t how) {
    (void)how;
    return calloc(count, size);
}
static inline void* rtapi_krealloc(void* memory, size_t size, rtapi_gfp_t how) {
    (void)how;
    return realloc(memory, size);
}
static inline void rtapi_kfree(void* memory) { free(memory); }
#endif
