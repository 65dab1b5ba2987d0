// SPDX-License-Identifier: MIT
#include "scope/trigger.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/core.h>
#include <utility>

#include "text/numbers.hpp"

namespace hal::tools {

namespace {

constexpr double hysteresis = 0.01;  // of the range

std::string_view trimmed(std::string_view text) {
    const auto begin = text.find_first_not_of(' ');
    return begin == text.npos ? std::string_view{}
                              : text.substr(begin, text.find_last_not_of(' ') - begin + 1);
}

}  // namespace

TriggerText read_trigger(std::string_view text) {
    static constexpr const char* examples =
        "type for example: --trigger 'x-error > 0.1', 'x-error < 0', '|x-error| > 0.1' or 'estop'";
    TriggerText read;
    std::string_view rest = trimmed(text);
    const bool state = rest.starts_with("level ");
    if (state) {
        rest = trimmed(rest.substr(6));
    }
    const auto at = rest.find_first_of("<>");
    if (at == rest.npos) {
        const bool falling = rest.starts_with('!');
        if (state) {
            if (falling) {
                rest = trimmed(rest.substr(1));
            }
            read.trigger.edge = (falling ? Edge::below : Edge::above);
        } else if (falling) {
            if (falling) {
                rest = trimmed(rest.substr(1));
            }
            read.trigger.edge = Edge::falling;
        } else {
            if (falling) {
                rest = trimmed(rest.substr(1));
            }
            read.trigger.edge = Edge::rising;
        }
        read.trigger.level = 0.5;
    } else {
        const std::string_view relation =
            rest.substr(at, rest.substr(at).starts_with("<>") ? 2 : 1);
        std::string_view value = rest.substr(at + relation.size());
        if (relation != "<>" && value.starts_with('=')) {
            value.remove_prefix(1);
        }
        const auto level = parse_real(trimmed(value));
        if (!level) {
            read.problem = fmt::format("invalid trigger '{}': '{}' is not a number; {}", text,
                                       trimmed(value), examples);
            return read;
        }
        if (state && relation == "<>") {
            read.problem = fmt::format("invalid trigger '{}': a level trigger takes > or <; {}",
                                       text, examples);
            return read;
        }
        read.trigger.level = *level;
        read.has_level = true;
        if (relation == "<>") {
            read.trigger.edge = Edge::either;
        } else if (relation == ">") {
            read.trigger.edge = (state ? Edge::above : Edge::rising);
        } else {
            read.trigger.edge = (state ? Edge::below : Edge::falling);
        }
        rest = trimmed(rest.substr(0, at));
    }
    if (rest.size() > 2 && rest.front() == '|' && rest.back() == '|') {
        read.trigger.magnitude = true;
        rest = trimmed(rest.substr(1, rest.size() - 2));
    }
    read.name = std::string(rest);
    if (rest.empty() || rest.find_first_of(" |!") != rest.npos) {
        read.problem =
            fmt::format("invalid trigger '{}': '{}' is not a name; {}", text, rest, examples);
    }
    return read;
}

std::string format_trigger(const Trigger& trigger, const std::vector<Channel>& channels) {
    if (trigger.source >= channels.size()) return "none";
    const Channel& channel = channels[trigger.source];
    const std::string name = trigger.magnitude ? "|" + channel.name + "|" : channel.name;
    const bool state = trigger.edge == Edge::above || trigger.edge == Edge::below;
    const bool downwards = trigger.edge == Edge::falling || trigger.edge == Edge::below;
    const char* const level = state ? "level " : "";
    if (channel.bit && trigger.edge != Edge::either) {
        return fmt::format("{}{}{}", level, downwards ? "!" : "", name);
    }
    return fmt::format("{}{} {} {:g}", level, name,
                       trigger.edge == Edge::either ? "<>"
                       : downwards                  ? "<"
                                                    : ">",
                       trigger.level);
}

/// Returns the hysteresis of an edge: a share of the range of the values so far.
double TriggerSearch::margin_with(double value) {
    const bool is_first = min_ > max_;
    min_ = is_first ? value : std::min(min_, value);
    max_ = is_first ? value : std::max(max_, value);
    const double range = max_ - min_;
    return bit_ || !std::isfinite(range) ? 0 : hysteresis * range;
}

/// Returns true when this sample completes an edge of the wanted direction.
bool TriggerSearch::crosses(double value, double margin) {
    const double level = trigger_.level;
    const bool rose = below_ && value >= level && trigger_.edge != Edge::falling;
    const bool fell = above_ && value <= level && trigger_.edge != Edge::rising;
    // A sample on the level may belong to both sides, but does not re-arm the edge that it is part
    // of.
    below_ = value < level - margin || (below_ && value < level);
    above_ = value > level + margin || (above_ && value > level);
    return rose || fell;
}

/// Returns when the straight line between two samples meets the level.
std::int64_t TriggerSearch::crossing_ns(const Sample& before, const Sample& after) const {
    if (bit_ || before.value == after.value) return after.time_ns;
    const double step = after.value - before.value;
    const double part = std::clamp((trigger_.level - before.value) / step, 0.0, 1.0);
    if (!std::isfinite(part)) return after.time_ns;
    const auto between = static_cast<double>(after.time_ns - before.time_ns);
    return before.time_ns + std::llround(part * between);
}

std::optional<std::int64_t> TriggerSearch::feed(Sample sample) {
    if (std::isnan(sample.value)) {
        rearm();  // an edge across an invalid value is not one
        return std::nullopt;
    }
    if (trigger_.magnitude) {
        sample.value = std::abs(sample.value);
    }
    const double margin = margin_with(sample.value);
    const auto at = std::optional(sample.time_ns);
    if (trigger_.edge == Edge::above) return sample.value >= trigger_.level ? at : std::nullopt;
    if (trigger_.edge == Edge::below) return sample.value <= trigger_.level ? at : std::nullopt;
    const bool has_crossed = crosses(sample.value, margin);
    const std::optional<Sample> before = std::exchange(last_, sample);
    if (!has_crossed) return std::nullopt;
    return before ? crossing_ns(*before, sample) : sample.time_ns;
}

void TriggerSearch::rearm() {
    below_ = false;
    above_ = false;
    last_.reset();
}

}  // namespace hal::tools
