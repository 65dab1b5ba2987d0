/* SPDX-License-Identifier: MIT */
#ifndef RTAPI_BOOL_H
#define RTAPI_BOOL_H
#include <stdbool.h>
typedef bool rtapi_bool;
#endif
