// SPDX-License-Identifier: MIT
#include "hal/abi.h"

extern "C" HAL_EXPORT const hal_component hal_plugin = {
    sizeof(hal_component) - sizeof(void*),
    HAL_ABI_MAJOR,
    HAL_ABI_MINOR,
    "test-short",
    "",
    "",
    0,
    1,
    8,
    8,
    nullptr,
    nullptr,
    nullptr,
    nullptr,
};
