// SPDX-License-Identifier: MIT
// The frames of the demo bus: the master sends a set-point to each device, and each device sends its
// value. Both are 32 bits with sign.
#pragma once

#include <cstdint>

#include "hal/pin_codec.hpp"
#include "link/can.hpp"

namespace hal::demo {

constexpr std::uint8_t max_address = 127;
constexpr std::uint32_t set_point_base = 0x200;
constexpr std::uint32_t value_base = 0x180;
constexpr PinCodec codec{PinCodec::Format::signed_integer, 32};

/// A value beyond 32 bits is limited. [realtime]
inline can::Frame set_point_frame(std::uint8_t address, double counts) noexcept {
    can::Frame frame;
    frame.id = set_point_base + address;
    frame.length = 4;
    write_bits(frame.data, 0, codec.bits(), codec.encode(counts));
    return frame;
}
/// Returns the address of the device that sent a value, 0: this is another frame. [realtime]
inline std::uint8_t sender_of(const can::Frame& frame) noexcept {
    const bool is_value = frame.is_standard_data() && frame.length == 4 && frame.id > value_base &&
                          frame.id <= value_base + max_address;
    return is_value ? static_cast<std::uint8_t>(frame.id - value_base) : std::uint8_t{0};
}
/// [realtime]
inline double counts_of(const can::Frame& frame) noexcept {
    return codec.decode<double>(read_bits(frame.data, 0, codec.bits()));
}

}  // namespace hal::demo
