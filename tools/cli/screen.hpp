// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <string>
#include <termios.h>
#include <vector>

#include "cli/keys.hpp"

namespace hal::tools {

/// The whole terminal during its lifetime: alternate screen, no cursor, keys without echo. Ctrl-C
/// still sends SIGINT (use StopRequest); Ctrl-Z is off. The destructor restores the terminal.
class Screen {
public:
    Screen();
    ~Screen();
    Screen(const Screen&) = delete;

    /// Asks the terminal for its size. Returns true when it has changed since the last call.
    bool measure();
    std::size_t columns() const { return columns_; }
    std::size_t rows() const { return rows_; }
    /// Draws the lines that differ from the last frame, in one write. Returns false when the
    /// terminal is gone.
    bool draw(const std::vector<std::string>& lines);
    /// Returns the keys typed so far; call it when standard input is readable, and after about 30
    /// ms with nothing to read.
    std::vector<Key> keys(bool readable);

private:
    termios before_{};
    bool raw_ = false;
    std::size_t columns_ = 0;
    std::size_t rows_ = 0;
    std::vector<std::string> last_;
    std::string bytes_;
};

/// Returns true when both standard input and output are a terminal that can move its cursor.
bool has_screen();
/// Returns true when the locale of the environment is UTF-8.
bool unicode_terminal();

}  // namespace hal::tools
