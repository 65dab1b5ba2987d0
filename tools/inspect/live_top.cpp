// SPDX-License-Identifier: MIT
#include "inspect/live_top.hpp"

#include <algorithm>
#include <poll.h>
#include <unistd.h>

#include "cli/cut_text.hpp"
#include "cli/screen.hpp"

namespace hal::tools {

namespace {

using Clock = std::chrono::steady_clock;
constexpr auto status_period = std::chrono::milliseconds(500);
constexpr int key_wait_ms = 30;  // then a lone Esc is a key

}  // namespace

/// The head of the table, as many of its rows as fit, and the keys.
std::vector<std::string> LiveTop::lines(std::size_t columns, std::size_t rows) {
    std::vector<std::string> lines = top_lines(seen_, columns);
    const std::size_t visible = std::max<std::size_t>(rows, 3) - 2;
    const std::size_t count = lines.size() - 1;
    const bool scrolls = count > visible;
    first_ = std::min(first_, scrolls ? count - visible : 0);
    lines.erase(lines.begin() + 1, lines.begin() + 1 + static_cast<std::ptrdiff_t>(first_));
    lines.resize(std::min(lines.size(), visible + 1));
    lines.emplace_back(scrolls ? "q quit  up down scroll" : "q quit");
    for (std::string& line : lines) {
        line = cut_text(line, columns);
    }
    return lines;
}

bool LiveTop::run(const StopRequest& stop, std::optional<std::chrono::nanoseconds> duration) {
    Screen screen;
    const auto begin = Clock::now();
    auto next_look = begin;
    bool dirty = true;
    while (!stop.requested() && (!duration || Clock::now() - begin < *duration)) {
        if (Clock::now() >= next_look) {
            seen_ = source_();
            next_look = Clock::now() + status_period;
            dirty = true;
        }
        dirty = screen.measure() || dirty;
        if (dirty && !screen.draw(lines(screen.columns(), screen.rows()))) return false;
        dirty = false;
        pollfd waiting[] = {{STDIN_FILENO, POLLIN, 0}, {stop.fd(), POLLIN, 0}};
        ::poll(waiting, 2, key_wait_ms);
        for (const Key& key : screen.keys((waiting[0].revents & POLLIN) != 0)) {
            if (key.character == 'q') return true;
            if (key.code == Code::down) {
                ++first_;
            } else if (key.code == Code::up && first_ > 0) {
                --first_;
            }
            dirty = true;
        }
        if ((waiting[0].revents & (POLLHUP | POLLERR)) != 0) return false;
    }
    return true;
}

}  // namespace hal::tools
