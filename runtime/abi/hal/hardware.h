/* SPDX-License-Identifier: MIT */
/*
 * Extension "hal.hardware/1", offered while an instance is created: whether its constructor may
 * access hardware to find out which pins there are. An editor, which checks a netlist at each
 * change, must not.
 */
#ifndef HAL_HARDWARE_H
#define HAL_HARDWARE_H

#include "hal/abi.h"

#ifdef __cplusplus
extern "C" {
#endif

#define HAL_HARDWARE "hal.hardware/1"

typedef struct hal_hardware {
    uint32_t size;
    /* Requests access to hardware. Returns false when it is denied: the constructor then fails
     * without a reason, and the lines that use its pins count as not checked. [setup] */
    bool (*request)(const hal_host *);
} hal_hardware;

#ifdef __cplusplus
}
#endif
#endif
