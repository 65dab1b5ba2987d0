/* SPDX-License-Identifier: MIT */
#ifndef RTAPI_LIMITS_H
#define RTAPI_LIMITS_H
#include <limits.h>
#endif
