/* SPDX-License-Identifier: MIT */
#ifndef RTAPI_MATH_H
#define RTAPI_MATH_H
#include <float.h>
#include <math.h>

/* A float's pattern of bits seen as an integer, of older components. */
#define rtapi_fabs fabs
#define rtapi_floor floor
#define rtapi_ceil ceil
#endif
