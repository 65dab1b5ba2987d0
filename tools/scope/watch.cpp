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

}  // namespace

int run_watch(const WatchOptions& options) {
    Input input;
    std::string problem;
    if (!input.connect(options.name, problem)) return fail(options, problem);
    const std::vector<std::string> names = input.expand(options.words, problem);
    if (!problem.empty() || !input.attach(names, 1, problem)) return fail(options, problem);
    WatchTable table(input.channels());
    const Input::Take take = [&](std::size_t channel, Sample sample) {
        table.feed(channel, sample);
    };
    StopRequest stop;
    const bool live = !options.once && has_screen();
    const std::int64_t for_ns = options.for_ns >= 0 ? options.for_ns : live ? -1 : once_ns;
    const auto end =
        for_ns >= 0 ? Clock::now() + std::chrono::nanoseconds(for_ns) : Clock::time_point::max();
    if (!live) {
        while (!stop.requested() && Clock::now() < end) {
            if (!input.take(20, take)) return fail(options, input.end_reason());
        }
        return print(joined(table.lines())) ? 0 : 1;
    }
    std::string ended;
    {
        Screen screen;
        std::size_t first = 0;
        auto next_picture = Clock::now();
        for (bool quit = false; !quit && !stop.requested() && Clock::now() < end;) {
            pollfd waiting[] = {
                {STDIN_FILENO, POLLIN, 0}, {input.fd(), POLLIN, 0}, {stop.fd(), POLLIN, 0}};
            ::poll(waiting, 3, 30);
            for (const Key& key : screen.keys((waiting[0].revents & POLLIN) != 0)) {
                if (key.character == 'q') {
                    quit = true;
                }
                if (key.character == 'r') {
                    table.reset();
                }
                if (key.code == Code::down) {
                    ++first;
                }
                if (key.code == Code::up && first > 0) {
                    --first;
                }
            }
            if ((waiting[0].revents & (POLLHUP | POLLERR)) != 0) {
                quit = true;
            }
            if (!input.take(0, take)) {
                ended = input.end_reason();
                break;
            }
            screen.measure();
            if (Clock::now() < next_picture) continue;
            next_picture = Clock::now() + picture_time;
            std::vector<std::string> lines = table.lines(screen.columns());
            const std::size_t rows = lines.size() - 1,
                              visible = screen.rows() > 2 ? screen.rows() - 2 : 1;
            first = std::min(first, rows > visible ? rows - visible : 0);
            lines.erase(lines.begin() + 1, lines.begin() + 1 + static_cast<std::ptrdiff_t>(first));
            if (lines.size() > visible + 1) {
                lines.resize(visible + 1);
            }
            lines.push_back(fmt::format(
                "q quit  r reset min and max{}{}", rows > visible ? "  up down scroll" : "",
                input.lost() > 0 ? fmt::format("  {} samples lost", input.lost()) : ""));
            if (!screen.draw(lines)) {
                quit = true;
            }
        }
    }
    return ended.empty() ? 0 : fail(options, ended);
}

}  // namespace hal::tools
