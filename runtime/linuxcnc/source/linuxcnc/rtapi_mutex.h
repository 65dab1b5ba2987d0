/* SPDX-License-Identifier: MIT */
/* rtapi_mutex(3): a word that is 0 while nobody has it. Only _try and _give belong into a cycle. */
#ifndef RTAPI_MUTEX_H
#define RTAPI_MUTEX_H
#include <sched.h>

static inline int rtapi_mutex_try(unsigned long* mutex) {
    return (int)__atomic_exchange_n(mutex, 1ul, __ATOMIC_ACQUIRE);
}
static inline void rtapi_mutex_get(unsigned long* mutex) {
    while (rtapi_mutex_try(mutex)) {
        sched_yield();
    }
}
static inline void rtapi_mutex_give(unsigned long* mutex) {
    __atomic_store_n(mutex, 0ul, __ATOMIC_RELEASE);
}
#endif
