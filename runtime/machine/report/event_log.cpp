// SPDX-License-Identifier: MIT
#include "machine/report/event_log.hpp"

#include <algorithm>
#include <new>
#include <string>
#include <utility>

#include "execute/executor.hpp"
#include "machine/report/fault_log.hpp"
#include "text/quoting.hpp"

namespace hal {
namespace {

std::string missing(std::uint64_t lines) {
    return "missing here: " + counted(static_cast<std::size_t>(lines), "line") +
           ", because the reader was too slow";
}

}  // namespace

EventLog::Position EventLog::begin() {
    ++listeners_;
    faults_.collect();
    collect_messages();
    return {count_, faults_.newest_number()};
}

void EventLog::end() {
    if (--listeners_ != 0) return;
    collect_messages();
    entries_.clear();
}

void EventLog::add(const char* kind, std::string text) {
    if (!wanted()) return;
    collect_messages();
    append({executor_.now_ns(), kind, std::move(text)});
}

void EventLog::append(LoggedEvent entry) {
    entries_.push_back(std::move(entry));
    ++count_;
    if (entries_.size() > kept) {
        entries_.pop_front();
    }
}

void EventLog::note(const char* kind, std::string_view line) noexcept {
    if (!wanted()) return;
    try {
        LoggedEvent entry{executor_.now_ns(), kind, std::string(line)};
        const std::scoped_lock own(messages_mutex_);
        if (messages_.size() < kept) {
            messages_.push_back(std::move(entry));
        } else {
            ++messages_lost_;
        }
    } catch (const std::bad_alloc&) {
    }  // it was printed
}

void EventLog::collect_messages() {
    std::vector<LoggedEvent> messages;
    std::uint64_t lost = 0;
    {
        const std::scoped_lock own(messages_mutex_);
        messages.swap(messages_);
        lost = std::exchange(messages_lost_, 0);
    }
    for (LoggedEvent& one : messages) {
        append(std::move(one));
    }
    if (lost != 0) {
        append({executor_.now_ns(), "message", missing(lost)});
    }
}

std::vector<LoggedEvent> EventLog::after(Position& position) {
    faults_.collect();
    collect_messages();
    std::vector<LoggedEvent> all;
    const std::uint64_t first = count_ - entries_.size();
    if (first > position.entry) {
        all.push_back({entries_.front().time_ns, "message", missing(first - position.entry)});
    }
    for (std::uint64_t i = std::max(first, position.entry); i < count_; ++i) {
        all.push_back(entries_[static_cast<std::size_t>(i - first)]);
    }
    position.entry = count_;
    for (const FaultRecord& record : faults_.records(0)) {
        if (record.number <= position.fault) continue;
        all.push_back({-record.age_ns, "fault", record.sentence});  // an age at time 0
        position.fault = record.number;
    }
    std::stable_sort(all.begin(), all.end(), [](const LoggedEvent& a, const LoggedEvent& b) {
        return a.time_ns < b.time_ns;
    });
    return all;
}

}  // namespace hal
