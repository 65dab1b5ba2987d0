// SPDX-License-Identifier: MIT
// How a command is written: its usage text, and what follows from it for the number of arguments.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "netlist/netlist.hpp"

namespace hal {

/// Words in CAPITALS are objects (completion knows them), `[x]` is optional, `x|y` a choice, `...`
/// repeats. ` | ` separates two forms; the second begins with an option: "FUNCTION THREAD | --auto
/// THREAD".
struct Usage {
    std::string_view name;       ///< of the command
    std::string_view arguments;  ///< may be empty
};

/// The text for messages, help and the manual: "net SIGNAL PIN...", forms separated by ", or ".
std::string to_string(const Usage& usage);

/// One word of the arguments.
struct UsageWord {
    std::string_view text;  ///< without brackets and dots: "POSITION", "lock|mem|all"
    bool optional = false;
    bool repeats = false;
    bool of_option = false; ///< stands behind an option in one bracket: TYPE in "[-t TYPE]"
};
/// The words of each form: "FUNCTION THREAD [POSITION]" has three. `arguments` lives as long as the
/// program does.
const std::vector<std::vector<UsageWord>>& usage_forms(std::string_view arguments);

/// Checks the number of arguments of the command named by `name`. Returns false after reporting
/// wrong-arguments.
bool check_arity(const Usage& usage, const Token& name, std::span<const Token> args,
                 Diagnostics& diagnostics);

}  // namespace hal
