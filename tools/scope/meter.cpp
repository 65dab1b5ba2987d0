// SPDX-License-Identifier: MIT
// `hal meter NAME`: one value of a running instance in large digits; a line per value when the
// output is not a terminal.
#include "scope/meter.hpp"

#include <chrono>
#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include "cli/output.hpp"
#include "cli/screen.hpp"
#include "cli/signals.hpp"
#include "scope/big_text.hpp"
#include "scope/input.hpp"
#include "scope/watch_table.hpp"
#include "text/glyphs.hpp"

namespace hal::tools {

namespace {

using MeterClock = std::chrono::steady_clock;
constexpr auto meter_period = std::chrono::milliseconds(100);

std::string joined_with_unit(const std::string& value, const std::string& unit) {
    return unit.empty() ? value : value + " " + unit;
}

std::vector<std::string> meter_picture(const WatchTable& table, const Channel& channel,
                                       std::uint64_t lost, std::size_t columns, std::size_t rows) {
    const WatchTable::Texts texts = table.texts(0);
    std::vector<std::string> lines{printable(channel.name), ""};
    constexpr std::size_t other_lines = 6;
    for (std::string& line :
         big_text(texts.value, columns, rows > other_lines ? rows - other_lines : 0,
                  unicode_terminal())) {
        lines.push_back(std::move(line));
    }
    lines.push_back(channel.unit);
    lines.push_back("");
    lines.push_back(fmt::format("min {}  max {}  {}", texts.min, texts.max, texts.rate));
    lines.push_back(lost > 0 ? fmt::format("q quit  r reset  {} samples lost", lost)
                             : "q quit  r reset min and max");
    return lines;
}

/// Prints the newest value each 100 ms; without --for once.
int print_values(const MeterOptions& options, Input& input, WatchTable& table,
                 const Input::Take& take) {
    StopRequest stop;
    const auto end = MeterClock::now() + std::chrono::nanoseconds(options.for_ns);
    for (auto next = MeterClock::now(); !stop.requested();) {
        if (!input.take(20, take)) return fail(options, input.end_reason());
        if (!table.has_value(0) || MeterClock::now() < next) continue;
        if (!print(joined_with_unit(table.texts(0).value, input.channels()[0].unit) + "\n")) {
            return 1;
        }
        next += meter_period;
        if (options.for_ns < 0 || next >= end) break;
    }
    return 0;
}

/// Draws until q, the end of the time or of the instance. Returns the reason of the latter.
std::string draw_values(const MeterOptions& options, Input& input, WatchTable& table,
                        const Input::Take& take) {
    StopRequest stop;
    Screen screen;
    const auto end = options.for_ns >= 0
                         ? MeterClock::now() + std::chrono::nanoseconds(options.for_ns)
                         : MeterClock::time_point::max();
    auto next_picture = MeterClock::now();
    while (!stop.requested() && MeterClock::now() < end) {
        pollfd waiting[] = {
            {STDIN_FILENO, POLLIN, 0}, {input.fd(), POLLIN, 0}, {stop.fd(), POLLIN, 0}};
        ::poll(waiting, 3, 30);
        for (const Key& key : screen.keys((waiting[0].revents & POLLIN) != 0)) {
            if (key.character == 'q') return "";
            if (key.character == 'r') {
                table.reset();
            }
        }
        if ((waiting[0].revents & (POLLHUP | POLLERR)) != 0) return "";
        if (!input.take(0, take)) return input.end_reason();
        screen.measure();
        if (MeterClock::now() < next_picture) continue;
        next_picture = MeterClock::now() + meter_period;
        if (!screen.draw(meter_picture(table, input.channels()[0], input.lost(), screen.columns(),
                                       screen.rows()))) {
            return "";
        }
    }
    return "";
}

}  // namespace

int run_meter(const MeterOptions& options) {
    Input input;
    std::string problem;
    if (!input.connect(options.name, problem)) return fail(options, problem);
    const std::vector<std::string> names = input.expand(options.words, problem);
    if (!problem.empty()) return fail(options, problem);
    if (names.size() != 1) {
        return fail(options, fmt::format("one value at a time, not {}; several: hal watch {}",
                                         names.size(), fmt::join(options.words, " ")));
    }
    if (!input.attach(names, 1, problem)) return fail(options, problem);
    WatchTable table(input.channels());
    const Input::Take take = [&](std::size_t channel, Sample sample) {
        table.feed(channel, sample);
    };
    if (!has_screen()) return print_values(options, input, table, take);
    const std::string ended = draw_values(options, input, table, take);
    return ended.empty() ? 0 : fail(options, ended);
}

}  // namespace hal::tools
