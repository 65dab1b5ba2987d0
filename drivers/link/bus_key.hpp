// SPDX-License-Identifier: MIT
// The key of a bus in the memory of a process. The machines of one process meet on a bus of the
// same name, but an editor loads a machine again while its model before still exists.
#pragma once

#include <cstdint>
#include <string>

/// Defined by the program of `hal lsp` only: counts the machines that an editor has loaded, the one
/// that is being loaded included. [setup]
extern "C" __attribute__((weak, visibility("default"))) std::uint64_t hal_load_number();

namespace hal::link {

/// Returns the key of the bus `name` for the machine that is being loaded: its name, in the program
/// of `hal lsp` with the number of the load. [setup]
inline std::string bus_key(const std::string& name) {
    if (hal_load_number == nullptr) return name;
    return std::to_string(hal_load_number()) + ":" + name;
}

}  // namespace hal::link
