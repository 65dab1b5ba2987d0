// SPDX-License-Identifier: MIT
// The file of <initCmds> in LinuxCNC's ethercat-conf.xml: start-up commands as TwinCAT exports
// them. Everything here is [setup].
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "ethercat/master/setup.hpp"

namespace hal::ethercat::config {

/// Receives an error or a warning: the line of the file, what is wrong, and what to write.
using InitProblem =
    std::function<void(bool error, std::uint32_t line, std::string sentence, std::string help)>;

/// Returns the objects and IDNs that a file writes, those of transition IP first. A mailbox works
/// from PRE-OP on, so that IP and PS are written in PRE-OP, and SO in SAFE-OP. Commands that read,
/// and those that are disabled, are left out.
std::vector<master::StartupWrite> read_init_commands(std::string_view xml,
                                                     const InitProblem& report);

}  // namespace hal::ethercat::config
