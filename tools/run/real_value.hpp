// SPDX-License-Identifier: MIT
#pragma once

#include "hal/abi.h"

namespace hal::tools {

/// Returns a value as a number: a bit is 0 or 1, 64 bits are rounded.
inline double real_value(hal_type type, hal_value value) {
    switch (type) {
    case HAL_TYPE_BIT: return value.bit ? 1.0 : 0.0;
    case HAL_TYPE_S32: return value.s32;
    case HAL_TYPE_U32: return value.u32;
    case HAL_TYPE_S64: return static_cast<double>(value.s64);
    case HAL_TYPE_U64: return static_cast<double>(value.u64);
    default: return value.real;
    }
}

}  // namespace hal::tools
