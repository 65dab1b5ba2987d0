/* SPDX-License-Identifier: MIT */
/* Single bits of a row of longs, atomically. */
#ifndef RTAPI_BITOPS_H
#define RTAPI_BITOPS_H
#include <limits.h>

#define HALCYON_LONG_BITS (sizeof(unsigned long) * CHAR_BIT)
static inline int rtapi_test_and_set_bit(int bit, unsigned long* row) {
    const unsigned long mask = 1ul << ((unsigned)bit % HALCYON_LONG_BITS);
    return (__atomic_fetch_or(row + (unsigned)bit / HALCYON_LONG_BITS, mask, __ATOMIC_SEQ_CST) &
            mask) != 0;
}
static inline int rtapi_test_and_clear_bit(int bit, unsigned long* row) {
    const unsigned long mask = 1ul << ((unsigned)bit % HALCYON_LONG_BITS);
    return (__atomic_fetch_and(row + (unsigned)bit / HALCYON_LONG_BITS, ~mask, __ATOMIC_SEQ_CST) &
            mask) != 0;
}
static inline int rtapi_test_bit(int bit, const unsigned long* row) {
    return (__atomic_load_n(row + (unsigned)bit / HALCYON_LONG_BITS, __ATOMIC_SEQ_CST) >>
            ((unsigned)bit % HALCYON_LONG_BITS)) &
           1;
}
static inline void rtapi_set_bit(int bit, unsigned long* row) {
    (void)rtapi_test_and_set_bit(bit, row);
}
static inline void rtapi_clear_bit(int bit, unsigned long* row) {
    (void)rtapi_test_and_clear_bit(bit, row);
}
#endif
