// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "bus/timeline/plan_output.hpp"
#include "hal/read_file.hpp"
#include "modbus/config/bus_config.hpp"

namespace hal::tools {

/// Reads a configuration and prints what is wrong in it. Returns whether it can be used; a message
/// was printed otherwise.
inline bool read_modbus_file(const Options& options, const std::string& file,
                             modbus::ReadResult& result) {
    std::string text;
    if (!read_regular_file(file, 65536, text)) {
        fail(options, "cannot read '" + file + "': " + text);
        return false;
    }
    result = modbus::read(text, file);
    return print_findings(file, text, result.messages, [](const auto& message) {
        return Code::named(modbus::code_of(message.topic)).value_or(Code("modbus-line"));
    });
}

}  // namespace hal::tools
