// SPDX-License-Identifier: MIT
#include "run/replayed_traces.hpp"

#include <algorithm>
#include <fmt/core.h>
#include <sstream>
#include <utility>

#include "cli/output.hpp"
#include "cli/screen.hpp"
#include "run/chosen_values.hpp"
#include "run/real_value.hpp"
#include "scope/chart.hpp"
#include "scope/view.hpp"
#include "text/numbers.hpp"

namespace hal::tools {
namespace {

constexpr std::size_t picture_columns = 100;
constexpr std::size_t picture_rows = 24;
constexpr std::size_t max_channels = 16;
constexpr char separator = '\n';  // in no line of the shell

}  // namespace

std::string ScopeCommand::joined(const std::vector<std::string>& words) {
    std::string text;
    for (const std::string& word : words) {
        text += word + separator;
    }
    return text;
}

std::string ScopeCommand::parse(const std::string& text) {
    std::istringstream in(text);
    std::string word;
    const auto next = [&in](std::string& to) { return !!std::getline(in, to, separator); };
    next(word);  // scope
    while (next(word)) {
        if (!word.starts_with("--")) {
            names.push_back(word);
            continue;
        }
        std::string value;
        if (!next(value)) return fmt::format("{} needs a value", word);
        if (word == "--svg") {
            svg = value;
        } else if (word == "--csv") {
            csv = value;
        } else if (word == "--pre" || word == "--post") {
            const auto duration = parse_duration_ns(value);
            if (!duration) return fmt::format("'{}' is not a valid time; write 20ms or 1s", value);
            (word == "--pre" ? pre_ns : post_ns) = *duration;
        } else {
            return fmt::format("unknown option '{}'", word);
        }
    }
    if (names.empty()) {
        return "write: scope NAME... [--pre 50ms] [--post 50ms] [--svg FILE] [--csv FILE]";
    }
    return pre_ns + post_ns > 0 ? "" : "the time before and after is 0";
}

std::string ScopeCommand::text_for(const std::vector<std::string>& values) const {
    std::vector<std::string> words = {"scope", "--pre", fmt::format("{}ns", pre_ns), "--post",
                                      fmt::format("{}ns", post_ns)};
    words.insert(words.end(), values.begin(), values.end());
    if (!svg.empty()) {
        words.insert(words.end(), {"--svg", svg});
    }
    if (!csv.empty()) {
        words.insert(words.end(), {"--csv", csv});
    }
    return joined(words);
}

ReplayedTraces::ReplayedTraces(Session& session, ScopeCommand command, std::int64_t moment_ns)
    : session_(session), command_(std::move(command)), moment_ns_(moment_ns) {
    names_ = named_values(session.model(), command_.names);
    samples_.resize(names_.size());
}

std::string ReplayedTraces::problem() const {
    if (names_.size() > max_channels) {
        return fmt::format("{} values match; at most {} are drawn", names_.size(), max_channels);
    }
    return unknown_value(session_.model(), command_.names);
}

Channel ReplayedTraces::channel_of(const std::string& name) const {
    const auto reading = session_.values().read({name}).front();
    const hal_type type = reading ? reading->type : HAL_TYPE_FLOAT;
    Channel channel;
    channel.name = name;
    channel.stepped = type != HAL_TYPE_FLOAT;
    channel.bit = type == HAL_TYPE_BIT;
    if (type == HAL_TYPE_S64) {
        channel.wide = Channel::Wide::s64;
    } else if (type == HAL_TYPE_U64) {
        channel.wide = Channel::Wide::u64;
    }
    const Pin* pin = session_.model().find_pin(name);
    if (const Signal* const signal = session_.model().find_signal(name)) {
        pin = signal->writer;
    }
    if (pin) {
        channel.unit = pin->unit;
    }
    return channel;
}

void ReplayedTraces::sample(std::int64_t time_ns) {
    const auto readings = session_.values().read(names_);
    for (std::size_t i = 0; i < readings.size(); ++i) {
        if (!readings[i]) continue;
        Samples& all = samples_[i];
        if (!all.empty() && all.back().time_ns >= time_ns) {
            all.pop_back();  // of another thread, which woke at the same time
        }
        const Reading& reading = *readings[i];
        all.push_back({time_ns, real_value(reading.type, reading.value), reading.value.raw});
    }
}

std::string ReplayedTraces::drawn(std::string& problem) const {
    std::vector<Channel> channels;
    for (const std::string& name : names_) {
        channels.push_back(channel_of(name));
    }
    Acquisition acquisition(channels, command_.pre_ns, command_.post_ns);
    acquisition.set_mode(Mode::normal);
    const auto feed = [&](bool after) {
        for (std::size_t i = 0; i < samples_.size(); ++i) {
            for (const Sample& sample : samples_[i]) {
                if ((sample.time_ns > moment_ns_) == after) {
                    acquisition.feed(i, sample);
                }
            }
        }
    };
    feed(false);
    acquisition.progress(moment_ns_);
    acquisition.force();
    feed(true);
    acquisition.progress(end_ns() + 1);
    const Record* const record = acquisition.record();
    if (!record) return "no cycle in this time\n";
    std::string text;
    const auto write = [&](const std::string& file, const std::string& content) {
        if (!problem.empty()) return;
        problem = write_file(file, content);
        if (problem.empty()) {
            text += file + "\n";
        }
    };
    if (!command_.svg.empty()) {
        write(command_.svg, chart_svg(channels, *record, "replayed"));
    }
    if (!command_.csv.empty()) {
        write(command_.csv, chart_csv(channels, *record));
    }
    if (!command_.svg.empty() || !command_.csv.empty()) return text;
    ScopeView view(acquisition, unicode_terminal(), false);
    const std::vector<std::string> lines =
        view.frame(picture_columns, picture_rows + channels.size());
    text = fmt::format(
        "around {:.6f} s, {}/div\n", static_cast<double>(moment_ns_) * 1e-9,
        format_duration(static_cast<double>(command_.pre_ns + command_.post_ns) / divisions_x));
    for (std::size_t i = 1; i + 1 < lines.size(); ++i) {  // without the states and the keys
        text += lines[i] + "\n";
    }
    return text;
}

}  // namespace hal::tools
