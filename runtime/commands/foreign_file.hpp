// SPDX-License-Identifier: MIT
// Files that are given in place of a netlist and belong to another command.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace hal {

/// The error about such a file.
struct ForeignFile {
    std::string sentence;  ///< "'m.eds' is not a netlist but a CANopen device description"
    std::string help;
};

/// Recognises a file by its extension, else by the beginning of its `text`. nullopt: it may be a
/// netlist. [setup]
std::optional<ForeignFile> foreign_file(const std::string& path, std::string_view text);

}  // namespace hal
