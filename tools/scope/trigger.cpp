// SPDX-License-Identifier: MIT
#include "scope/trigger.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/core.h>

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

std::optional<std::int64_t> TriggerSearch::feed(Sample sample) {
    if (std::isnan(sample.value)) {
        rearm();  // an edge across an invalid value is not one
        return std::nullopt;
    }
    if (trigger_.magnitude) {
        sample.value = std::abs(sample.value);
    }
    const bool first = least_ > most_;
    least_ = first ? sample.value : std::min(least_, sample.value);
    most_ = first ? sample.value : std::max(most_, sample.value);
    const double margin =
        bit_ || !std::isfinite(most_ - least_) ? 0 : hysteresis * (most_ - least_);
    const double x = sample.value;
    const double level = trigger_.level;
    if (trigger_.edge == Edge::above) {
        return x >= level ? std::optional(sample.time_ns) : std::nullopt;
    }
    if (trigger_.edge == Edge::below) {
        return x <= level ? std::optional(sample.time_ns) : std::nullopt;
    }
    const bool rose = below_ && x >= level && trigger_.edge != Edge::falling;
    const bool fell = above_ && x <= level && trigger_.edge != Edge::rising;
    // A sample on the level may belong to both sides, but does not re-arm the edge that it is part
    // of.
    below_ = x < level - margin || (below_ && x < level);
    above_ = x > level + margin || (above_ && x > level);
    const std::optional<Sample> before = last_;
    last_ = sample;
    if (!rose && !fell) return std::nullopt;
    if (bit_ || !before || before->value == x) return sample.time_ns;
    const double part = std::clamp((level - before->value) / (x - before->value), 0.0, 1.0);
    return std::isfinite(part)
               ? before->time_ns +
                     std::llround(part * static_cast<double>(sample.time_ns - before->time_ns))
               : sample.time_ns;
}

void TriggerSearch::rearm() {
    below_ = above_ = false;
    last_.reset();
}

}  // namespace hal::tools
