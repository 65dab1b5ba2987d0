/* SPDX-License-Identifier: MIT */
/*
 * Extension "hal.pin_names/1", offered while an instance is created: pins whose names do not begin
 * with that of the instance.
 */
#ifndef HAL_PIN_NAMES_H
#define HAL_PIN_NAMES_H

#include "hal/abi.h"

#ifdef __cplusplus
extern "C" {
#endif

#define HAL_PIN_NAMES "hal.pin_names/1"

typedef struct hal_pin_names {
    uint32_t size;
    /* Declares whether the names of further pins are complete, without the name of the instance.
     * [setup] */
    void (*whole)(const hal_host *, bool whole);
} hal_pin_names;

#ifdef __cplusplus
}
#endif
#endif
