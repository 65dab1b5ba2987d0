// SPDX-License-Identifier: MIT
// `hal watch NAME…`: live values of a running instance, with extremes over every cycle.
#include "scope/watch.hpp"

#include <algorithm>
#include <chrono>
#include <fmt/core.h>
#include <poll.h>
#include <unistd.h>

#include "cli/output.hpp"
#include "cli/screen.hpp"
#include "cli/signals.hpp"
#include "scope/input.hpp"
#include "scope/watch_table.hpp"

namespace hal::tools {

namespace {

using Clock = std::chrono::steady_clock;
constexpr auto picture_time = std::chrono::milliseconds(100);
constexpr std::int64_t once_ns = 1'000'000'000;

std::string joined(const std::vector<std::string>& lines) {
    std::string text;
    for (const std::string& line : lines) {
        text += line + "\n";
    }
    return text;
}

/// The picture of `hal watch` on a terminal.
class LiveWatch {
public:
    LiveWatch(Input& input, WatchTable& table, const StopRequest& stop)
        : input_(input), table_(table), stop_(stop) {}

    /// Draws until `end` or until the user quits. Returns why the input has ended, "" otherwise.
    std::string run(Clock::time_point end) {
        auto next_picture = Clock::now();
        while (!quit_ && !stop_.requested() && Clock::now() < end) {
            handle_keys();
            const bool more = input_.take(
                0, [&](std::size_t channel, Sample sample) { table_.feed(channel, sample); });
            if (!more) return input_.end_reason();
            screen_.measure();
            if (Clock::now() < next_picture) continue;
            next_picture = Clock::now() + picture_time;
            draw();
        }
        return "";
    }

private:
    /// Waits for keys, samples or the stop, 30 ms at most.
    void handle_keys() {
        pollfd waiting[] = {
            {STDIN_FILENO, POLLIN, 0}, {input_.fd(), POLLIN, 0}, {stop_.fd(), POLLIN, 0}};
        ::poll(waiting, 3, 30);
        for (const Key& key : screen_.keys((waiting[0].revents & POLLIN) != 0)) {
            handle(key);
        }
        if ((waiting[0].revents & (POLLHUP | POLLERR)) != 0) {
            quit_ = true;
        }
    }

    void handle(const Key& key) {
        if (key.character == 'q') {
            quit_ = true;
        } else if (key.character == 'r') {
            table_.reset();
        } else if (key.code == Code::down) {
            ++first_;
        } else if (key.code == Code::up && first_ > 0) {
            --first_;
        }
    }

    void draw() {
        std::vector<std::string> lines = table_.lines(screen_.columns());
        const std::size_t rows = lines.size() - 1;
        const std::size_t visible = screen_.rows() > 2 ? screen_.rows() - 2 : 1;
        const bool scrolls = rows > visible;
        first_ = std::min(first_, scrolls ? rows - visible : 0);
        lines.erase(lines.begin() + 1, lines.begin() + 1 + static_cast<std::ptrdiff_t>(first_));
        if (lines.size() > visible + 1) {
            lines.resize(visible + 1);
        }
        std::string help = "q quit  r reset min and max";
        if (scrolls) {
            help += "  up down scroll";
        }
        if (input_.lost() > 0) {
            help += fmt::format("  {} samples lost", input_.lost());
        }
        lines.push_back(std::move(help));
        if (!screen_.draw(lines)) {
            quit_ = true;
        }
    }

    Input& input_;
    WatchTable& table_;
    const StopRequest& stop_;
    Screen screen_;
    std::size_t first_ = 0;  // of the rows, the first that is visible
    bool quit_ = false;
};

}  // namespace

int run_watch(const WatchOptions& options) {
    Input input;
    std::string problem;
    if (!input.connect(options.name, problem)) return fail(options, problem);
    const std::vector<std::string> names = input.expand(options.words, problem);
    if (!problem.empty() || !input.attach(names, 1, problem)) return fail(options, problem);
    WatchTable table(input.channels());
    StopRequest stop;
    const bool live = !options.once && has_screen();
    std::int64_t for_ns = options.for_ns;
    if (for_ns < 0 && !live) {
        for_ns = once_ns;
    }
    const auto end =
        for_ns >= 0 ? Clock::now() + std::chrono::nanoseconds(for_ns) : Clock::time_point::max();
    if (live) {
        const std::string ended = LiveWatch(input, table, stop).run(end);
        return ended.empty() ? 0 : fail(options, ended);
    }
    const Input::Take take = [&](std::size_t channel, Sample sample) {
        table.feed(channel, sample);
    };
    while (!stop.requested() && Clock::now() < end) {
        if (!input.take(20, take)) return fail(options, input.end_reason());
    }
    return exit_code(print(joined(table.lines())));
}

}  // namespace hal::tools
