// SPDX-License-Identifier: MIT
// `[HAL]TWOPASS`: several texts with the loads of all of them done first. Internal to the shell.
//
// Loading is additive here, so that the loads of all files need not be merged into one line per
// component: doing them first, in order, gives the same instances, but for LinuxCNC's modules,
// which are loaded once. loadusr comes before that, as in LinuxCNC's first pass.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include "commands/script_texts.hpp"
#include "netlist/netlist.hpp"
#include "text/diagnostic.hpp"

namespace hal {

/// The commands of several texts, sorted by pass.
class TwoPass {
public:
    TwoPass(ScriptTexts& texts, Shell& shell, Diagnostics& problems)
        : texts_(texts), shell_(shell), problems_(problems) {}

    /// A text that opts out of TWOPASS runs as it is, in its turn.
    struct Whole {
        std::uint32_t text;
        std::size_t before;  ///< the index in rest() of the first command behind it
    };

    void add(std::uint32_t text);
    const std::vector<Command>& programs() const { return programs_; }
    const std::vector<Command>& loads() const { return loads_; }
    const std::vector<Command>& rest() const { return rest_; }
    const std::vector<Whole>& whole() const { return whole_; }

private:
    void sort(std::uint32_t text);
    void sort_included(Command command);

    ScriptTexts& texts_;
    Shell& shell_;
    Diagnostics& problems_;
    std::vector<Command> programs_, loads_, rest_;
    std::vector<Whole> whole_;
};

/// Merges a `loadrt` of a LinuxCNC module into the one that `loads` has of the same module.
/// Returns false for any other command.
bool merge_load(const Command& command, std::vector<Command>& loads);

/// Returns true for a text that has `#NOTWOPASS` anywhere, case and blanks ignored.
bool opts_out_of_two_pass(std::string_view text);

}  // namespace hal
