// SPDX-License-Identifier: MIT
// The devices by name, and the text description of a line:
//
//     # one device per line, in the order of the cable
//     coupler
//     servo axes=2 alias=5 serial=1
//     digital_in bits=16
//     esi file=drive.xml device=SERVO-1     # as the description of its maker has it
//
// Everything here is [setup].
#pragma once

#include <functional>
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
    std::string name;                   ///< as in the registry
    std::unique_ptr<Firmware> firmware;
    std::vector<std::uint8_t> sii;      ///< contents of its EEPROM
    unsigned ports = 2;
    /// the controller has distributed clocks
    bool dc = false;
};

/// Makes a device; nullopt for an unknown name.
std::optional<Device> make(std::string_view name, const DeviceOptions& = {});
/// Returns the names that make() accepts.
std::vector<std::string_view> names();

enum class LineTopic : std::uint8_t { device, option };
/// A line as its description has it.
struct LineDescription {
    struct Slave {
        std::string device;
        DeviceOptions options;
        text::Span at;
    };
    std::vector<Slave> slaves;
    std::vector<text::Message<LineTopic>> messages;
};
/// Returns the path of a file that a description names.
using FindFile = std::function<std::string(const std::string& name)>;
/// Reads the description of a line; invalid lines are reported in `messages` and left out. Without
/// `find`, paths start at the working folder.
LineDescription read_line(std::string_view text, const FindFile& find = {});
/// Returns a FindFile for names relative to the folder of a file.
FindFile beside(const std::string& path);
/// Makes the devices of a line.
std::vector<Device> make_line(const LineDescription&);

}  // namespace hal::ethercat::devices
