/* SPDX-License-Identifier: MIT */
#ifndef RTAPI_ATOMIC_H
#define RTAPI_ATOMIC_H
#include <stdatomic.h>
#endif
