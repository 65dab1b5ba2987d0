// SPDX-License-Identifier: MIT
// The options of a device in a line description.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "cia402/drive/axis_settings.hpp"

namespace hal::ethercat::esi {
struct Device;
struct File;
}
namespace hal::ethercat::devices {

/// Returns the motor of a servo before its options: 10 000 increments per revolution, up to
/// 12 000 r/min, an absolute encoder, no limits of the travel. [setup]
cia402::MotorSettings servo_motor();

/// See the top of this file.
struct DeviceOptions {
    unsigned bits = 8;
    unsigned channels = 4;
    unsigned axes = 1;
    std::uint16_t alias = 0;
    std::uint32_t serial = 0;
    bool dc_required = false;
    std::uint32_t modes = 0x3ef;  ///< of a servo (6502h)
    cia402::MotorSettings motor = servo_motor();  ///< of a servo
    /// description of an esi device, and its name there; empty: the only one
    std::string file{};
    std::string device{};
    std::optional<std::uint32_t> revision{};  ///< of an esi device; nullopt: the newest
    /// modules of a modular esi device, as in "A, -, 0x12"; empty: the default ones
    std::string modules{};
    std::vector<std::uint32_t> module_idents{};  ///< of the slots
    std::shared_ptr<const esi::File> description{};  ///< the contents of `file`
    const esi::Device* described = nullptr;  ///< the device in `description`
};

}  // namespace hal::ethercat::devices
