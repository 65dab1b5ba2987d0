// SPDX-License-Identifier: MIT
// The commands that move through the cycles of a journal, as errands.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "journal/journal_file.hpp"
#include "run/errand.hpp"

namespace hal::tools {

/// Parses step, continue, reverse, goto, break, where, back. [setup]
class ReplayCommands {
public:
    /// The file outlives it. Threads are those it has.
    explicit ReplayCommands(JournalFile& file) : file_(file) {}

    static bool is_known(std::string_view name);
    /// Returns why the words are invalid; "" after setting `errand`.
    std::string parse(const std::vector<std::string>& words, Errand& errand);
    /// Returns the condition of `break`; "": none.
    const std::string& condition() const { return condition_; }

private:
    using Words = const std::vector<std::string>&;
    struct Row {
        std::string_view name;
        std::string (ReplayCommands::*parse)(Words, Errand&);
    };
    static const Row rows[];

    std::string step(Words words, Errand& errand);
    std::string run(Words words, Errand& errand);
    std::string reverse(Words words, Errand& errand);
    std::string position(Words words, Errand& errand);
    std::string set_break(Words words, Errand& errand);
    std::string where(Words words, Errand& errand);
    std::string parse_step(Words words, std::size_t first, Errand& errand);

    JournalFile& file_;
    std::string condition_;
};

}  // namespace hal::tools
