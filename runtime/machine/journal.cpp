// SPDX-License-Identifier: MIT
#include "machine/journal.hpp"

#include <algorithm>
#include <new>
#include <utility>

#include "machine/state.hpp"

namespace hal {

Journal::Position Journal::begin() {
    ++listeners_;
    state_.faults.collect();
    collect_messages();
    return {count_, state_.faults.newest_number()};
}

void Journal::end() {
    if (--listeners_ != 0) return;
    collect_messages();
    entries_.clear();
}

void Journal::add(const char* kind, std::string text) {
    if (!wanted()) return;
    collect_messages();
    append({state_.executor->now_ns(), kind, std::move(text)});
}

void Journal::append(JournalEntry entry) {
    entries_.push_back(std::move(entry));
    ++count_;
    if (entries_.size() > kept) entries_.pop_front();
}

void Journal::message(std::string_view line) noexcept {
    if (!wanted()) return;
    try {
        JournalEntry entry{state_.executor->now_ns(), "message", std::string(line)};
        const std::scoped_lock own(messages_mutex_);
        if (messages_.size() < kept) messages_.push_back(std::move(entry));
    } catch (const std::bad_alloc&) {}  // it was printed
}

void Journal::collect_messages() {
    std::vector<JournalEntry> messages;
    {
        const std::scoped_lock own(messages_mutex_);
        messages.swap(messages_);
    }
    for (JournalEntry& one : messages) append(std::move(one));
}

std::vector<JournalEntry> Journal::after(Position& position) {
    state_.faults.collect();
    collect_messages();
    std::vector<JournalEntry> all;
    const std::uint64_t first = count_ - entries_.size();
    for (std::uint64_t i = std::max(first, position.entry); i < count_; ++i) all.push_back(entries_[i - first]);
    position.entry = count_;
    for (const FaultRecord& record : state_.faults.records(0)) {
        if (record.number <= position.fault) continue;
        all.push_back({-record.age_ns, "fault", record.sentence});  // an age at time 0
        position.fault = record.number;
    }
    std::stable_sort(all.begin(), all.end(), [](const JournalEntry& a, const JournalEntry& b) { return a.time_ns < b.time_ns; });
    return all;
}

}  // namespace hal
