// SPDX-License-Identifier: MIT
#include "run/value_check.hpp"

#include <algorithm>
#include <cstring>
#include <limits>
#include <string_view>

#include "run/chosen_values.hpp"

namespace hal::tools {
namespace {

/// Returns the pin whose function computes the value; nullptr: none does.
const Pin* writer_of(const Model& model, const std::string& name) {
    if (const Pin* const pin = model.find_pin(name)) {
        const bool reads = pin->signal && pin->dir == HAL_DIR_IN;
        return reads ? pin->signal->writer : pin;
    }
    const Signal* const signal = model.find_signal(name);
    return signal ? signal->writer : nullptr;
}

}  // namespace

ValueCheck::ValueCheck(const std::string& path, std::int64_t unix_offset_ns)
    : unix_offset_ns_(unix_offset_ns) {
    if (!mcap::load(path, recording_, problem_)) return;
    for (const mcap::Table& table : recording_.tables) {
        if (!table.thread.empty()) {
            tables_[table.thread].push_back({&table});
        }
    }
}

void ValueCheck::begin(Session& session, const std::vector<std::string>& names) {
    session_ = &session;
    probe_ = session.probes().attach({names}, problem_);
    if (probe_) {
        layout_ = Probes::layout(*probe_);
    }
}

bool ValueCheck::compare() {
    if (difference_) return false;
    if (!probe_) return true;
    for (const ProbeRows& rows : session_->probes().take(*probe_, max_taken, Probes::Rest::taken)) {
        compare(rows);
    }
    return !difference_;
}

void ValueCheck::compare(const ProbeRows& rows) {
    if (rows.layout) {
        layout_ = *rows.layout;
        for (auto& [thread, positions] : tables_) {
            for (Position& position : positions) {
                position.pairs.clear();
            }
        }
    }
    std::size_t at = 0;
    for (const auto& part : rows.parts) {
        const ProbeGroup& group = layout_.groups[part.group];
        std::vector<std::uint64_t> words(group.columns.size() + 2);
        for (std::size_t i = 0; i < part.rows; ++i, at += words.size() * 8) {
            std::memcpy(words.data(), rows.bytes.data() + at, words.size() * 8);
            if (group.thread.empty()) continue;
            compare({group.thread, words[0], static_cast<std::int64_t>(words[1]), &group.columns,
                     words.data() + 2});
        }
    }
}

/// The order in which functions run: the first value that is wrong is the cause of the others.
std::size_t ValueCheck::rank(const std::string& name) const {
    constexpr std::size_t last = std::numeric_limits<std::size_t>::max();
    const Pin* const pin = writer_of(session_->model(), name);
    if (!pin || !pin->home || !pin->instance) return last;
    const auto& functions = pin->home->functions;
    for (std::size_t i = 0; i < functions.size(); ++i) {
        const bool own = pin->function == functions[i];
        const bool shared =
            !pin->function && std::ranges::find(functions[i]->instances, pin->instance) !=
                                  functions[i]->instances.end();
        if (own || shared) return i;
    }
    return last;
}

/// Returns which word of an executed row is which column of a recorded one.
std::vector<std::pair<std::size_t, std::size_t>> ValueCheck::pairs_of(
    const mcap::Table& table, const std::vector<std::size_t>& columns) const {
    std::map<std::string_view, std::size_t> index_of;
    for (std::size_t i = 0; i < table.columns.size(); ++i) {
        index_of.emplace(table.columns[i].name, i);
    }
    std::vector<std::pair<std::size_t, std::size_t>> pairs;
    for (std::size_t i = 0; i < columns.size(); ++i) {
        const auto found = index_of.find(Probes::columns(*probe_)[columns[i]].name);
        if (found != index_of.end()) {
            pairs.emplace_back(i, found->second);
        }
    }
    return pairs;
}

void ValueCheck::compare(const Row& row) {
    const std::int64_t time_ns = row.time_ns + unix_offset_ns_;
    std::optional<ValueDifference> first;
    std::size_t others = 0;
    for (Position& position : tables_[row.thread]) {
        const mcap::Table& table = *position.table;
        auto& at = position.row;
        while (at < table.rows() && table.times_ns[at] < time_ns) {
            ++at;
        }
        if (at == table.rows() || table.times_ns[at] != time_ns) continue;
        if (position.pairs.empty()) {
            position.pairs = pairs_of(table, *row.columns);
        }
        values_ += position.pairs.size();
        const std::uint64_t* const recorded = &table.words[at * table.columns.size()];
        for (const auto& [executed, column] : position.pairs) {
            if (recorded[column] == row.words[executed]) continue;
            ++others;
            const std::string& name = table.columns[column].name;
            if (!first || rank(name) < rank(first->name)) {
                first = {name,
                         row.thread,
                         row.cycle,
                         row.time_ns,
                         table.columns[column].type,
                         recorded[column],
                         row.words[executed],
                         0};
            }
        }
    }
    if (first && (!difference_ || first->time_ns < difference_->time_ns)) {
        difference_ = first;
        difference_->others = others - 1;
    }
}

}  // namespace hal::tools
