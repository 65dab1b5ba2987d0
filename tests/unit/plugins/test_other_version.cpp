// SPDX-License-Identifier: MIT
#include "hal/abi.h"

extern "C" HAL_EXPORT const hal_component hal_plugin = {
    sizeof(hal_component),
    HAL_ABI_MAJOR + 1,
    0,
    "test-other-version",
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
