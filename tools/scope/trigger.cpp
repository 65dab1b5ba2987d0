// SPDX-License-Identifier: MIT
#include "scope/trigger.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/core.h>
#include <optional>
#include <utility>

#include "text/characters.hpp"
#include "text/find_row.hpp"
#include "text/numbers.hpp"

namespace hal::tools {

namespace {

constexpr double hysteresis = 0.01;  // of the range

/// A relation as written, and the edges that it means: by itself, and after the word `level`.
struct Relation {
    std::string_view text;
    Edge edge;
    std::optional<Edge> level;
};
constexpr Relation relations[] = {{"<>", Edge::either, std::nullopt},
                                  {">=", Edge::rising, Edge::above},
                                  {">", Edge::rising, Edge::above},
                                  {"<=", Edge::falling, Edge::below},
                                  {"<", Edge::falling, Edge::below}};

const char* relation_of(Edge edge) {
    if (edge == Edge::either) return "<>";
    return edge == Edge::falling || edge == Edge::below ? "<" : ">";
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
        const bool inverted = rest.starts_with('!');
        constexpr Edge edges[][2] = {{Edge::rising, Edge::falling}, {Edge::above, Edge::below}};
        read.trigger.edge = edges[state][inverted];
        read.trigger.level = 0.5;
        rest = trimmed(rest.substr(inverted ? 1 : 0));
    } else {
        const Relation& relation = *find_row_if(
            relations, [&](const Relation& r) { return rest.substr(at).starts_with(r.text); });
        const std::string_view value = trimmed(rest.substr(at + relation.text.size()));
        const auto level = parse_real(value);
        if (!level) {
            read.problem = fmt::format("invalid trigger '{}': '{}' is not a number; {}", text,
                                       value, examples);
            return read;
        }
        if (state && !relation.level) {
            read.problem = fmt::format("invalid trigger '{}': a level trigger takes > or <; {}",
                                       text, examples);
            return read;
        }
        read.trigger.level = *level;
        read.has_level = true;
        read.trigger.edge = state ? *relation.level : relation.edge;
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
    const char* const level = state ? "level " : "";
    const char* const relation = relation_of(trigger.edge);
    if (channel.bit && trigger.edge != Edge::either) {
        return fmt::format("{}{}{}", level, *relation == '<' ? "!" : "", name);
    }
    return fmt::format("{}{} {} {:g}", level, name, relation, trigger.level);
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
