// SPDX-License-Identifier: MIT
// The devices by name, and the text description of a line:
//
//     # one device per line, in the order of the cable
//     coupler
//     servo axes=2 alias=5 serial=1
//     digital_in bits=16
//
// Everything here is [setup].
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "ethercat/devices/io_devices.hpp"
#include "text/config_text.hpp"

namespace hal::ethercat::devices {

/// An emulated slave: its firmware, and what its controller needs.
struct Device {
    std::string               name;                   ///< as in the registry
    std::unique_ptr<Firmware> firmware;
    std::vector<std::uint8_t> sii;      ///< contents of its EEPROM
    unsigned                  ports = 2;
    bool                      dc = false;                    ///< the controller has distributed clocks
};

/// Makes a device; nullopt for an unknown name.
std::optional<Device> make(std::string_view name, const DeviceOptions& = {});
/// Returns the names that make() accepts.
std::vector<std::string_view> names();

enum class LineTopic : std::uint8_t { device, option };
/// A line as its description has it.
struct LineDescription {
    struct Slave {
        std::string   device;
        DeviceOptions options;
        text::Span    at;
    };
    std::vector<Slave>                    slaves;
    std::vector<text::Message<LineTopic>> messages;
};
/// Reads the description of a line; invalid lines are reported in `messages` and left out.
LineDescription read_line(std::string_view text);
/// Makes the devices of a line.
std::vector<Device> make_line(const LineDescription&);

}  // namespace hal::ethercat::devices
