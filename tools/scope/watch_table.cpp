// SPDX-License-Identifier: MIT
#include "scope/watch_table.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/core.h>

#include "text/glyphs.hpp"

namespace hal::tools {

namespace {

constexpr std::int64_t mark_ns = 100'000'000, window_ns = 1'000'000'000;

std::string shown(const Channel& channel, double value) {
    if (channel.bit) return value != 0 ? "TRUE" : "FALSE";
    return channel.stepped ? fmt::format("{:.0f}", value) : fmt::format("{:.7g}", value);
}

}  // namespace

void WatchTable::feed(std::size_t channel, Sample sample) {
    Row& row = rows_[channel];
    if (!row.any || std::isnan(row.min)) row.min = row.max = sample.value;
    row.edges += row.any && row.last.value != sample.value;
    row.any = true;
    row.last = sample;
    row.min = std::min(row.min, sample.value);
    row.max = std::max(row.max, sample.value);
    if (row.marks.empty() || sample.time_ns - row.marks.back().sample.time_ns >= mark_ns) row.marks.push_back({sample, row.edges});
    while (row.marks.size() > 1 && sample.time_ns - row.marks[1].sample.time_ns >= window_ns) row.marks.pop_front();
}

void WatchTable::reset() {
    for (Row& row : rows_) row.min = row.max = row.last.value;
}

WatchTable::Texts WatchTable::texts(std::size_t channel) const {
    const Row& row = rows_[channel];
    const Channel& about = channels_[channel];
    if (!row.any) return {"-", "-", "-", "-"};
    const auto seconds = static_cast<double>(row.last.time_ns - row.marks.front().sample.time_ns) * 1e-9;
    const double change = about.bit ? static_cast<double>(row.edges - row.marks.front().edges) : row.last.value - row.marks.front().sample.value;
    const std::string rate = seconds > 0 && std::isfinite(change) ? fmt::format("{:.4g} {}/s", change / seconds, about.bit ? "edges" : about.unit) : "-";
    return {shown(about, row.last.value), shown(about, row.min), shown(about, row.max), rate};
}

std::vector<std::string> WatchTable::lines() const {
    std::size_t width = 4;
    for (const Channel& channel : channels_) width = std::max(width, columns(channel.name));
    std::vector<std::string> lines{fmt::format("{:<{}} {:>14} {:<8} {:>14} {:>14} {:>14}", "NAME", width, "VALUE", "UNIT", "MIN", "MAX", "RATE")};
    for (std::size_t i = 0; i < rows_.size(); ++i) {
        const Channel& channel = channels_[i];
        const Texts texts = this->texts(i);
        const std::string name = printable(channel.name) + std::string(width - columns(channel.name), ' ');
        lines.push_back(fmt::format("{} {:>14} {:<8} {:>14} {:>14} {:>14}", name, texts.value, channel.unit, texts.min, texts.max, texts.rate));
    }
    return lines;
}

}  // namespace hal::tools
