// SPDX-License-Identifier: MIT
// The manual pages of the commands, section 1, in troff: hal, one for each command and each group of
// commands, and halcmd for the commands of netlists and of the shell. They are made from the tables
// of commands and from the declared options, as the help is.
#pragma once

#include <string>
#include <vector>

namespace hal::tools {

struct CommandPage {
    std::string name;  ///< of the page: hal-can-dump
    std::string troff;
};

/// Returns the pages of all commands that this build has, hal and halcmd first. [setup]
std::vector<CommandPage> command_pages();

}  // namespace hal::tools
