// SPDX-License-Identifier: MIT
#include "cli/drawn_lines.hpp"

#include <algorithm>
#include <fmt/core.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include "cli/cut_text.hpp"
#include "text/glyphs.hpp"

namespace hal::tools {

TerminalSize terminal_size() {
    winsize size{};
    if (::ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) != 0 || size.ws_col == 0 || size.ws_row == 0) {
        return {};
    }
    return {size.ws_col, size.ws_row};
}

/// Moves the cursor to the first line. A terminal that became narrower has wrapped the lines.
std::string DrawnLines::back_to_start(const TerminalSize& size) const {
    std::size_t rows = 0;
    for (const std::size_t width : widths_) {
        rows += std::max<std::size_t>((width + size.columns - 1) / size.columns, 1);
    }
    return rows == 0 ? "\r" : fmt::format("\r\033[{}A", rows);
}

std::string DrawnLines::replaced_by(std::vector<std::string> lines, const TerminalSize& size) {
    std::string frame = back_to_start(size);
    const std::size_t capacity = std::max<std::size_t>(size.rows, 2) - 1;
    if (lines.size() > capacity) {
        lines.erase(lines.begin(), lines.end() - static_cast<std::ptrdiff_t>(capacity));
    }
    widths_.clear();
    for (const std::string& line : lines) {
        const std::string text = cut_text(line, size.columns - 1);
        widths_.push_back(columns(text));
        frame += text + "\033[K\n";
    }
    return frame + "\033[J";
}

std::string DrawnLines::erased(const TerminalSize& size) {
    std::string sequence = back_to_start(size) + "\033[J";
    widths_.clear();
    return sequence;
}

}  // namespace hal::tools
