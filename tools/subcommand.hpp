// SPDX-License-Identifier: MIT
// A row of the table of subcommands. The table is compiled once for each program, because a row has
// the function of its command only in the program that contains it (part.hpp); what reads the table
// is compiled once for all programs (command_line.cpp).
#pragma once

#include <memory>
#include <span>
#include <type_traits>

#include "base/tree_packages.hpp"
#include "cli/option_set.hpp"
#include "part.hpp"

namespace hal::tools {

struct Subcommand {
    const char* name;     ///< more than one word in a group: "can dump"
    const char* usage;    ///< what may follow the name
    const char* summary;
    std::unique_ptr<Options> (*make_options)();
    Part part;
    int (*run)(const Options&);  ///< nullptr: in another program
    /// from the first word on, everything counts as words, including `-1` and `--`
    bool verbatim;
    /// whether these options need hal-tools, although `hal` has the command
    bool (*needs_tools)(const Options&) = nullptr;
    const char* package = "";  ///< of the tree; empty: the core

    /// The package, where this build leaves it out; else nullptr.
    const TreePackage* missing_package() const {
        const TreePackage* const found = find_tree_package(package);
        return found && !found->built() ? found : nullptr;
    }
};

/// Makes a row. `Where` is an In, whose function takes the command's own options, O.
template <class O, class Where>
constexpr Subcommand command(const char* name, const char* usage, const char* summary,
                             bool verbatim = false) {
    const auto make = []() -> std::unique_ptr<Options> { return std::make_unique<O>(); };
    Subcommand row{name,    usage,    summary, make,          Where::part,
                   nullptr, verbatim, nullptr, Where::package};
    if constexpr (!std::is_null_pointer_v<std::remove_const_t<decltype(Where::run)>>) {
        row.run = [](const Options& options) { return Where::run(static_cast<const O&>(options)); };
    }
    return row;
}

/// Commands of two and more words have a first word in common.
struct Group {
    const char* name;
    const char* purpose;
};

/// Returns the table of this program, in the order of the overview; the rows of a group are
/// adjacent. [any]
std::span<const Subcommand> subcommands();

/// Returns the groups of this program. [any]
std::span<const Group> subcommand_groups();

}  // namespace hal::tools
