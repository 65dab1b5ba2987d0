// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/core.h>

#include "bench.hpp"
#include "text/glyphs.hpp"

namespace hal::bench {
namespace {

/// Three significant digits; whole numbers from 1000.
std::string number(double value) {
    if (value == 0.0 || !std::isfinite(value)) {
        return fmt::format("{:.0f}", value);
    }
    const int before = static_cast<int>(std::floor(std::log10(std::fabs(value)))) + 1;
    return fmt::format("{:.{}f}", value, std::clamp(3 - before, 0, 4));
}

std::string figure(double value, const std::string& unit) {
    return unit.empty() ? number(value) : number(value) + " " + unit;
}

std::string goal_number(double value) { return fmt::format("{:g}", value); }

std::string padded(const std::string& text, std::size_t width, bool right) {
    const std::size_t has = columns(text);
    const std::string blanks(width > has ? width - has : 0, ' ');
    return right ? blanks + text : text + blanks;
}

}  // namespace

void Report::section(const std::string& title) { lines_.push_back({Line::Kind::section, {title}}); }
void Report::note(const std::string& sentence) { lines_.push_back({Line::Kind::note, {sentence}}); }

void Report::row(const Row& row) {
    Line line{Line::Kind::row, {row.what}};
    auto& [what, ours, peer, ratio, target, verdict] = line.cells;
    if (row.ours) {
        ours = figure(*row.ours, row.unit);
    }
    peer = row.theirs ? row.peer + " " + figure(*row.theirs, row.unit) : row.peer;
    std::optional<bool> reached;
    double times = 0;  // of ours to theirs, less is better
    bool peer_misses = false;
    const bool both = row.ours && row.theirs && *row.ours > 0.0 && *row.theirs > 0.0;
    switch (row.goal.kind) {
    case Goal::Kind::none:
        if (both) {
            ratio = "× " + number(*row.ours / *row.theirs);
        }
        break;
    case Goal::Kind::at_most:
    case Goal::Kind::not_above:
        target = row.goal.kind == Goal::Kind::not_above ? "≤ × 1 ± 10 %"
                                                        : "≤ × " + goal_number(row.goal.value);
        if (both) {
            ratio = "× " + number(*row.ours / *row.theirs);

            reached = *row.ours / *row.theirs <= row.goal.value;
        } else if (row.ours && row.theirs) {
            reached = *row.ours <= *row.theirs * row.goal.value;
        }
        break;
    case Goal::Kind::times_less:
        target = "≥ " + goal_number(row.goal.value) + " × less";
        if (both) {
            ratio = number(*row.theirs / *row.ours) + " × less";

            reached = *row.theirs / *row.ours >= row.goal.value;
        }
        break;
    case Goal::Kind::limit:
        target = "≤ " + goal_number(row.goal.value) + (row.unit.empty() ? "" : " " + row.unit);
        if (both) {
            times = *row.ours / *row.theirs;
            ratio = "× " + number(times);
        }
        if (row.ours) {
            reached = *row.ours <= row.goal.value;
        }
        peer_misses = both && *row.theirs > row.goal.value;
        break;
    case Goal::Kind::at_least:
        target = "≥ " + goal_number(row.goal.value) + (row.unit.empty() ? "" : " " + row.unit);
        if (both) {
            times = *row.theirs / *row.ours;
            ratio = "time × " + number(times);
        }
        if (row.ours) {
            reached = *row.ours >= row.goal.value;
        }
        peer_misses = both && *row.theirs < row.goal.value;
        break;
    }
    if (row.goal.kind != Goal::Kind::none) {
        verdict = !row.ours  ? "not measured"
                  : !reached ? "no peer here"
                  : *reached ? "reached"
                             : "NOT reached";
    }
    if (row.goal.beside > 0.0 && reached == false && peer_misses) {
        verdict = fmt::format("{} × {:g} of the peer, which misses it too",
                              times <= row.goal.beside ? "within" : "NOT within", row.goal.beside);
    }
    lines_.push_back(std::move(line));
}

std::string Report::text() const {
    static constexpr std::array<const char*, 6> titles{"",      "ours",   "peer",
                                                       "ratio", "target", "verdict"};
    static constexpr std::array<bool, 6> right{false, true, true, true, true, false};
    std::array<std::size_t, 6> widths{};
    for (std::size_t i = 0; i < widths.size(); ++i) {
        widths[i] = columns(titles[i]);
        for (const Line& line : lines_) {
            if (line.kind == Line::Kind::row) {
                widths[i] = std::max(widths[i], columns(line.cells[i]));
            }
        }
    }
    const auto table_line = [&](const auto& cells) {
        std::string text;
        for (std::size_t i = 0; i < widths.size(); ++i) {
            text += (i ? "  " : "  ") + padded(cells[i], widths[i], right[i]);
        }
        return text.substr(0, text.find_last_not_of(' ') + 1) + "\n";
    };
    std::string text;
    for (std::size_t i = 0; i < lines_.size(); ++i) {
        const Line& line = lines_[i];
        if (line.kind == Line::Kind::section) {
            text += "\n" + line.cells[0] + "\n";
            if (i + 1 < lines_.size() && lines_[i + 1].kind == Line::Kind::row) {
                text += table_line(titles);
            }
        } else if (line.kind == Line::Kind::note) {
            text += "    " + line.cells[0] + "\n";
        } else {
            text += table_line(line.cells);
        }
    }
    return text;
}

}  // namespace hal::bench
