// SPDX-License-Identifier: MIT
// Devices on smart serial, as they describe themselves.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "mesa/hostmot2/module.hpp"
#include "mesa/hostmot2/smart_serial.hpp"

namespace hal::mesa {

/// A value of the process data, and where its bits are in the user registers of a direction.
struct RemoteField {
    smart_serial::Record record;
    unsigned bit = 0;

    bool is_output() const noexcept { return record.direction != smart_serial::Direction::in; }
    bool is_input() const noexcept { return record.direction != smart_serial::Direction::out; }
};
/// A value that is read once, at the discovery.
struct RemoteConstant {
    std::string name;
    std::uint32_t value = 0;
};

struct Remote {
    unsigned port = 0;
    unsigned channel = 0;
    unsigned mode = 0;
    std::string kind;  ///< "7i76"
    std::uint32_t serial_number = 0;
    std::vector<RemoteField> outputs, inputs;
    std::vector<RemoteConstant> constants;
    unsigned output_bits = 0;
    unsigned input_bits = 0;

    /// Returns its name in names of pins, "7i76.0.0".
    std::string name() const {
        return kind + "." + std::to_string(port) + "." + std::to_string(channel);
    }
    unsigned output_words() const noexcept { return (output_bits + 31) / 32; }
    unsigned input_words() const noexcept { return (input_bits + 31) / 32; }
};

/// A smart-serial port with the devices that were found on it.
struct RemotePort {
    unsigned port = 0;
    std::uint16_t command = 0;  ///< addresses of the registers of the port
    std::uint16_t data = 0;
    ModuleAddresses addresses;
    std::vector<Remote> remotes;

    /// Returns the channels with a device, a bit each.
    std::uint32_t mask() const noexcept {
        std::uint32_t mask = 0;
        for (const Remote& remote : remotes) {
            mask |= 1U << remote.channel;
        }
        return mask;
    }
    /// Returns the address of register `reg` of a channel.
    std::uint16_t of_channel(unsigned reg, unsigned channel) const noexcept {
        return static_cast<std::uint16_t>(addresses.at(reg, port) + 4 * channel);
    }
};

}  // namespace hal::mesa
