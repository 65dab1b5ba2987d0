// SPDX-License-Identifier: MIT
// The files of a machine to start from: axes with drives on a bus, all simulated, and an
// emergency-stop chain.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace hal::tools {

struct NewFile {
    std::string name;
    std::string text;
};

struct NewMachine {
    static constexpr int max_axes = 9;  ///< x y z a b c u v w

    std::string name;
    int axes = 3;
    std::string bus = "none";
};

/// The buses that a new machine can have: none, canopen, ethercat.
std::vector<std::string_view> machine_buses();

/// Returns the netlist, its INI file, the configuration of the bus, a test with its expected
/// output, and a README. `machine.bus` is one of machine_buses(). [setup]
std::vector<NewFile> machine_files(const NewMachine& machine);

}  // namespace hal::tools
