// SPDX-License-Identifier: MIT
// The device types of LinuxCNC's lcec: a table in lcec_device_table.cpp, from which the process
// data and the pins of a slave come. Everything here is [setup].
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "ethercat/config/config_text.hpp"

namespace hal::ethercat::config {

/// A row of the table: a device, and the description of its process data and pins.
struct LcecDevice {
    std::string name;  ///< `type` of <slave>
    std::uint32_t vendor = 0;
    std::uint32_t product = 0;
    std::string shape;   ///< the lines of the table that describe it, shared by similar devices
    unsigned count = 0;  ///< channels; N in the lines of the shape
    unsigned second_count = 0;  ///< M in the lines of the shape: of a second kind, else as N
    std::vector<std::pair<std::string, std::string>> options;  ///< defaults other than the shape's
};

/// Returns the device with this name; names are compared exactly.
std::optional<LcecDevice> find_lcec_device(std::string_view name);
/// Gives a device that belongs to the one before it on the bus the count of that one. Returns false
/// if `before` is null or of another kind.
bool count_as_neighbour(LcecDevice&, const LcecDevice* before);
/// Returns all names, in the order of the table.
std::vector<std::string> lcec_device_names();
/// Returns the names of the devices of lcec that this table has no process data for.
std::vector<std::string> unsupported_lcec_devices();
/// Returns the names of the modParams of a device.
std::vector<std::string> lcec_parameters(const LcecDevice&);

/// Adds the process data, the start-up writes and the channels of a device. `cycle_ns` is that of
/// the bus. Invalid values of `parameters` are reported in `problems`.
void build_lcec_device(const LcecDevice&, const std::map<std::string, std::string>& parameters,
                       std::int64_t cycle_ns, master::Slave&, SlaveInfo&,
                       std::vector<std::string>& problems);

/// The text of the table; docs/internals/lcec-devices.md has its grammar.
extern const char* const lcec_device_table;

}  // namespace hal::ethercat::config
