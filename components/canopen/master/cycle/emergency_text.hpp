// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "canopen/master/config/master_config.hpp"

namespace hal::canopen {

/// The code of an emergency of that node in words: those of CiA 402 where the node is a drive, by
/// its device type or because it exchanges a controlword or statusword, of any of its axes; else
/// the class of CiA 301. [any, not real time]
const char* emergency_text(const config::MasterConfig&, std::uint8_t node,
                           std::uint16_t code) noexcept;

}  // namespace hal::canopen
