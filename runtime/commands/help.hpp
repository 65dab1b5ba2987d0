// SPDX-License-Identifier: MIT
#pragma once

#include <string>

namespace hal {

/// Returns the manual of all commands in Markdown, made from the command table.
std::string command_manual();

}  // namespace hal
