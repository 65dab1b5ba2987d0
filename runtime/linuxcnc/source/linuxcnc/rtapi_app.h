/* SPDX-License-Identifier: MIT */
/* The two functions that a LinuxCNC component gives. */
#ifndef RTAPI_APP_H
#define RTAPI_APP_H
#include "rtapi.h"

#ifdef __cplusplus
extern "C" {
#endif
/* [setup] makes pins and functions; negative: the instance cannot be made */
int rtapi_app_main(void);
void rtapi_app_exit(void); /* [setup] */
#ifdef __cplusplus
}
#endif
#endif
