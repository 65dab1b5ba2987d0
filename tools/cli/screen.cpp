// SPDX-License-Identifier: MIT
#include "cli/screen.hpp"

#include <cstdlib>
#include <fmt/core.h>
#include <string_view>
#include <strings.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include "cli/output.hpp"

namespace hal::tools {

Screen::Screen() {
    if (::tcgetattr(STDIN_FILENO, &before_) == 0) {
        termios raw = before_;
        raw.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO);
        raw.c_cc[VSUSP] = raw.c_cc[VQUIT] = _POSIX_VDISABLE;
        raw.c_cc[VMIN] = raw.c_cc[VTIME] = 0;
        raw_ = ::tcsetattr(STDIN_FILENO, TCSANOW, &raw) == 0;
    }
    print("\033[?1049h\033[?25l\033[H\033[2J");
    measure();
}

Screen::~Screen() {
    print("\033[0m\033[?25h\033[?1049l");
    if (raw_) {
        ::tcsetattr(STDIN_FILENO, TCSAFLUSH, &before_);
    }
}

bool Screen::measure() {
    winsize size{};
    if (::ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) != 0 || size.ws_col == 0) {
        size.ws_col = 80;
        size.ws_row = 24;
    }
    if (size.ws_col == columns_ && size.ws_row == rows_) return false;
    columns_ = size.ws_col;
    rows_ = size.ws_row;
    last_.clear();
    return true;
}

bool Screen::draw(const std::vector<std::string>& lines) {
    std::string frame;
    if (last_.empty()) {
        frame += "\033[2J";
    }
    for (std::size_t i = 0; i < rows_; ++i) {
        const std::string line = i < lines.size() ? lines[i] : "";
        if (i < last_.size() && last_[i] == line) continue;
        frame += fmt::format("\033[{};1H{}\033[0m\033[K", i + 1, line);
    }
    last_.assign(rows_, "");
    for (std::size_t i = 0; i < rows_ && i < lines.size(); ++i) {
        last_[i] = lines[i];
    }
    // synchronised output, where the terminal knows it
    return frame.empty() || print("\033[?2026h" + frame + "\033[?2026l");
}

std::vector<Key> Screen::keys(bool readable) {
    char block[256];
    ssize_t n = 0;
    while (readable && (n = ::read(STDIN_FILENO, block, sizeof block)) > 0) {
        bytes_.append(block, static_cast<std::size_t>(n));
    }
    return pop_keys(bytes_, !readable);
}

bool has_screen() {
    const char* const term = std::getenv("TERM");
    return ::isatty(STDIN_FILENO) && ::isatty(STDOUT_FILENO) && term &&
           std::string_view(term) != "dumb";
}

bool unicode_terminal() {
    for (const char* name : {"LC_ALL", "LC_CTYPE", "LANG"}) {
        if (const char* value = std::getenv(name); value && *value) {
            return ::strcasestr(value, "utf-8") || ::strcasestr(value, "utf8");
        }
    }
    return false;
}

}  // namespace hal::tools
