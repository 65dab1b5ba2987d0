// SPDX-License-Identifier: MIT
// Names of the pins that every slave has besides those of its process data.
#pragma once

#include <array>
#include <string_view>

namespace hal::ethercat::state_pin {

inline constexpr const char* online = "online";
inline constexpr const char* operational = "operational";
inline constexpr const char* state = "state";
inline constexpr const char* al_status_code = "al-status-code";
inline constexpr const char* dc_deviation = "dc-sync-diff";
inline constexpr const char* losses = "losses";
inline constexpr const char* crc_errors = "crc-errors";
inline constexpr const char* lost_links = "lost-links";
inline constexpr const char* emergency = "emcy";
inline constexpr const char* emergency_count = "emcy-count";

/// An object with one of these names gets another one.
inline constexpr std::array<std::string_view, 10> all{
    online, operational, state,      al_status_code, dc_deviation,
    losses, crc_errors,  lost_links, emergency,      emergency_count};

}  // namespace hal::ethercat::state_pin
