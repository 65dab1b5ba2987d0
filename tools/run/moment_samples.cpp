// SPDX-License-Identifier: MIT
#include "run/moment_samples.hpp"

#include <algorithm>
#include <fmt/core.h>
#include <nlohmann/json.hpp>
#include <sstream>

#include "commands/json_text.hpp"
#include "model/model.hpp"
#include "run/chosen_values.hpp"

namespace hal::tools {
namespace {

using Json = nlohmann::ordered_json;

void append(std::string& to, std::uint64_t word) {
    for (std::size_t i = 0; i < sizeof word; ++i) {
        to += static_cast<char>(word >> (8 * i));
    }
}

/// Returns a value as a word of a row.
std::uint64_t word_of(const Reading& reading) {
    switch (reading.type) {
    case HAL_TYPE_BIT: return reading.value.bit ? 1 : 0;
    case HAL_TYPE_S32: return static_cast<std::uint64_t>(std::int64_t{reading.value.s32});
    case HAL_TYPE_U32: return reading.value.u32;
    default: return reading.value.raw;
    }
}

/// Returns the pin that a value is of: the writer of a signal, or one of its readers.
const Pin* pin_of(const Model& model, const std::string& name) {
    if (const Signal* const signal = model.find_signal(name)) {
        if (signal->writer) return signal->writer;
        return signal->pins.empty() ? nullptr : signal->pins.front();
    }
    return model.find_pin(name);
}

}  // namespace

MomentSamples::MomentSamples(Session& session, const std::string& names, const std::string& fastest)
    : session_(session), fastest_(fastest) {
    std::istringstream in(names);
    std::vector<std::string> wanted;
    for (std::string name; in >> name;) {
        wanted.push_back(name);
    }
    if (wanted.empty() || wanted.size() > max_names) {
        problem_ = fmt::format("1 to {} names are possible, not {}", max_names, wanted.size());
        return;
    }
    problem_ = unknown_value(session.model(), wanted);
    for (std::string& name : wanted) {
        Column& column = columns_.emplace_back();
        column.name = std::move(name);
    }
    group_columns();
}

/// Gives the values that the machine has by now their groups.
void MomentSamples::group_columns() {
    for (std::size_t i = 0; i < columns_.size(); ++i) {
        if (!columns_[i].is_grouped) {
            group_column(i);
        }
    }
}

void MomentSamples::group_column(std::size_t index) {
    Column& column = columns_[index];
    const auto reading = session_.values().read({column.name}).front();
    if (!reading) return;
    column.is_grouped = true;
    column.type = reading->type;
    const Pin* const pin = pin_of(session_.model(), column.name);
    const Thread* const thread = pin ? thread_of(*pin) : nullptr;
    if (pin) {
        column.unit = pin->unit;
    }
    Group& group = group_of(thread ? thread->name : fastest_);
    group.columns.push_back(index);
    group.names.push_back(column.name);
    ++grouped_;
}

/// Returns a group without rows: a value that is loaded later has a group of its own.
MomentSamples::Group& MomentSamples::group_of(const std::string& thread) {
    const auto known = std::ranges::find_if(groups_, [&thread](const Group& group) {
        return group.thread == thread && group.words.empty();
    });
    if (known != groups_.end()) return *known;
    Group& group = groups_.emplace_back();
    group.thread = thread;
    for (const auto& one : session_.model().threads) {
        if (one->name == thread) {
            group.period_ns = one->options.period_ns;
        }
    }
    return group;
}

void MomentSamples::add(const JournaledCycle& cycle) {
    if (grouped_ < columns_.size()) {
        group_columns();
    }
    for (Group& group : groups_) {
        if (group.thread == cycle.thread) {
            add_row(group, cycle);
        }
    }
    if (words_ > max_words) {
        drop_oldest();
    }
}

void MomentSamples::add_row(Group& group, const JournaledCycle& cycle) {
    const auto readings = session_.values().read(group.names);
    const auto exists = [](const auto& reading) { return reading.has_value(); };
    if (!std::ranges::all_of(readings, exists)) return;  // one was unloaded
    group.words.push_back(cycle.number);
    group.words.push_back(static_cast<std::uint64_t>(cycle.time_ns));
    for (const auto& reading : readings) {
        group.words.push_back(word_of(*reading));
    }
    words_ += group.width();
}

/// Leaves out the older half of all rows.
void MomentSamples::drop_oldest() {
    words_ = 0;
    for (Group& group : groups_) {
        const std::size_t rows = group.words.size() / group.width() / 2;
        const auto begin = group.words.begin();
        group.words.erase(begin, begin + static_cast<std::ptrdiff_t>(rows * group.width()));
        left_out_ += rows;
        words_ += group.words.size();
    }
}

std::string MomentSamples::answer(std::int64_t until_ns) const {
    Json columns = Json::array();
    for (const Column& column : columns_) {
        columns.push_back(
            {{"name", column.name}, {"type", hal::name(column.type)}, {"unit", column.unit}});
    }
    Json groups = Json::array();
    Json parts = Json::array();
    std::string rows;
    for (std::size_t i = 0; i < groups_.size(); ++i) {
        const Group& group = groups_[i];
        groups.push_back(
            {{"thread", group.thread}, {"period_ns", group.period_ns}, {"columns", group.columns}});
        parts.push_back({{"group", i}, {"rows", group.words.size() / group.width()}, {"lost", 0}});
        for (const std::uint64_t word : group.words) {
            append(rows, word);
        }
    }
    std::string text = json_text({{"layout", 1},
                                  {"time_ns", 0},
                                  {"columns", std::move(columns)},
                                  {"groups", std::move(groups)},
                                  {"left_out", left_out_}});
    text += "\n" + json_text({{"layout", 1},
                              {"until_ns", until_ns},
                              {"parts", std::move(parts)},
                              {"bytes", rows.size()}});
    return text + "\n" + rows;
}

}  // namespace hal::tools
