// SPDX-License-Identifier: MIT
// Lines that are drawn again in the same place of a terminal, below what was printed before.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace hal::tools {

struct TerminalSize {
    std::size_t columns = 80;
    std::size_t rows = 24;
};

/// Returns the size of standard output; 80 x 24 if the terminal does not know it.
TerminalSize terminal_size();

/// The lines that a terminal shows last; the cursor is below them. Returns texts to print, and
/// prints nothing itself. Not synchronised.
class DrawnLines {
public:
    /// Returns `lines` in the place of the last ones. They are cut so that a column and a row stay
    /// free: the terminal neither wraps nor scrolls them. Of too many, the last ones are drawn.
    std::string replaced_by(std::vector<std::string> lines, const TerminalSize& size);
    /// Returns what removes the lines.
    std::string erased(const TerminalSize& size);

private:
    std::string back_to_start(const TerminalSize& size) const;

    std::vector<std::size_t> widths_;  // in columns
};

}  // namespace hal::tools
