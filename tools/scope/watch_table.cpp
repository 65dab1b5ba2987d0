// SPDX-License-Identifier: MIT
#include "scope/watch_table.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/core.h>

#include "text/glyphs.hpp"

namespace hal::tools {

namespace {

constexpr std::int64_t mark_ns = 100'000'000;
constexpr std::int64_t window_ns = 1'000'000'000;

std::string shown(const Channel& channel, const Sample& sample) {
    if (channel.bit) return sample.value != 0 ? "TRUE" : "FALSE";
    if (channel.wide != Channel::Wide::no) return digits(channel, sample);
    return channel.stepped ? fmt::format("{:.0f}", sample.value)
                           : fmt::format("{:.7g}", sample.value);
}

/// The unit of a change per second: m/s for m, m/s^2 for m/s, rad/s^3 for rad/s^2.
std::string rate_unit(const Channel& channel) {
    const std::string_view unit = channel.bit ? std::string_view("edges") : channel.unit;
    const std::size_t slash = unit.rfind("/s");
    if (slash != unit.npos && slash + 2 == unit.size()) {
        return fmt::format("{}^2", unit);
    }
    if (slash != unit.npos && slash + 4 == unit.size() && unit[slash + 2] == '^' &&
        unit.back() >= '2' && unit.back() <= '8') {
        return fmt::format("{}{}", unit.substr(0, unit.size() - 1),
                           static_cast<char>(unit.back() + 1));
    }
    return fmt::format("{}/s", unit);
}

/// The end of a text, for names whose beginnings are the same.
std::string end_of(const std::string& text, std::size_t width) {
    if (columns(text) <= width || width == 0) return text;
    std::size_t at = 0;
    while (columns(text.substr(at)) + 1 > width) {
        do {
            ++at;
        } while (at < text.size() && (static_cast<unsigned char>(text[at]) & 0xc0) == 0x80);
    }
    return "…" + text.substr(at);
}

}  // namespace

void WatchTable::feed(std::size_t channel, Sample sample) {
    Row& row = rows_[channel];
    if (!row.any || std::isnan(row.min.value)) {
        row.min = row.max = sample;
    }
    row.edges += row.any && row.last.value != sample.value;
    row.any = true;
    row.last = sample;
    if (below(channels_[channel], sample, row.min)) {
        row.min = sample;
    }
    if (below(channels_[channel], row.max, sample)) {
        row.max = sample;
    }
    if (row.marks.empty() || sample.time_ns - row.marks.back().sample.time_ns >= mark_ns) {
        row.marks.push_back({sample, row.edges});
    }
    while (row.marks.size() > 1 && sample.time_ns - row.marks[1].sample.time_ns >= window_ns) {
        row.marks.pop_front();
    }
}

void WatchTable::reset() {
    for (Row& row : rows_) {
        row.min = row.max = row.last;
    }
}

WatchTable::Texts WatchTable::texts(std::size_t channel) const {
    const Row& row = rows_[channel];
    const Channel& about = channels_[channel];
    if (!row.any) {
        return {"-", "-", "-", "-"};
    }
    const auto seconds =
        static_cast<double>(row.last.time_ns - row.marks.front().sample.time_ns) * 1e-9;
    const double change = about.bit ? static_cast<double>(row.edges - row.marks.front().edges)
                                    : row.last.value - row.marks.front().sample.value;
    const std::string rate = seconds > 0 && std::isfinite(change)
                                 ? fmt::format("{:.4g} {}", change / seconds, rate_unit(about))
                                 : "-";
    return {shown(about, row.last), shown(about, row.min), shown(about, row.max), rate};
}

std::vector<std::string> WatchTable::lines(std::size_t columns) const {
    constexpr std::size_t min_name_columns = 4;
    constexpr std::size_t of_value = 15;
    constexpr std::size_t of_unit = 9;
    constexpr std::size_t of_extremes = 30;

    constexpr std::size_t of_rate = 15;
    std::size_t width = min_name_columns;
    for (const Channel& channel : channels_) {
        width = std::max(width, hal::columns(printable(channel.name)));
    }
    std::size_t left =
        columns > of_value + min_name_columns ? columns - of_value : min_name_columns;
    width = std::min(width, left);
    left -= width;
    const auto fits = [&](std::size_t needed) {
        const bool enough = left >= needed;
        left = enough ? left - needed : 0;
        return enough;
    };
    const bool unit = fits(of_unit);
    const bool extremes = unit && fits(of_extremes);

    const bool rate = extremes && fits(of_rate);
    const auto line = [&](const std::string& name, const std::string& of, const Texts& texts) {
        const std::string shown = end_of(name, width);
        std::string text = fmt::format("{}{} {:>14}", shown,
                                       std::string(width - hal::columns(shown), ' '), texts.value);
        if (unit) {
            text += fmt::format(" {:<8}", of);
        }
        if (extremes) {
            text += fmt::format(" {:>14} {:>14}", texts.min, texts.max);
        }
        return rate ? text + fmt::format(" {:>14}", texts.rate) : text;
    };
    std::vector<std::string> lines{line("NAME", "UNIT", {"VALUE", "MIN", "MAX", "RATE"})};
    for (std::size_t i = 0; i < rows_.size(); ++i) {
        lines.push_back(line(printable(channels_[i].name), channels_[i].unit, texts(i)));
    }
    return lines;
}

}  // namespace hal::tools
