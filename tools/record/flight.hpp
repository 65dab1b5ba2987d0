// SPDX-License-Identifier: MIT
// A flight recorder: the newest samples in memory, and what an event makes of them.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "control/probe_client.hpp"
#include "record/sink.hpp"

namespace hal::tools {

/// The samples, layouts and journal entries of the last time, bounded in bytes too.
class FlightMemory {
public:
    static constexpr std::size_t most_bytes = std::size_t{512} << 20;

    FlightMemory(std::vector<ProbeGroup> groups, std::int64_t last_ns) : last_ns_(last_ns) { layout(std::move(groups)); }

    void layout(std::vector<ProbeGroup> groups);
    void add(ProbeBatch&& batch);
    void add(const ProbeClient::Entry& entry) { entries_.push_back(entry); }
    /// Writes the samples and entries between the two times. Returns false after a failed write.
    bool write(Sink& sink, std::int64_t begin_ns, std::int64_t end_ns, std::uint64_t& rows) const;
    /// Forgets what is older than the time to be kept, reckoned from `now_ns`; nothing after `but_from_ns`.
    void prune(std::int64_t now_ns, std::int64_t but_from_ns);
    std::size_t bytes() const { return bytes_; }

private:
    struct Held {
        std::size_t layout;
        ProbeBatch batch;
    };
    struct Last {  // the newest row that was forgotten of a group whose rows come on change only
        std::size_t layout, group;
        std::vector<std::uint64_t> words;
    };
    void note_last(const Held& held);

    const std::int64_t last_ns_;
    std::vector<std::vector<ProbeGroup>> layouts_;
    std::deque<Held> batches_;
    std::deque<ProbeClient::Entry> entries_;
    std::vector<Last> last_;
    std::size_t bytes_ = 0;
};

/// Decides when a file is written and what it is called.
class FlightTrigger {
public:
    FlightTrigger(std::int64_t last_ns, std::int64_t after_ns) : last_ns_(last_ns), after_ns_(after_ns) {}

    /// Notes an event. During the time after an earlier one it prolongs that, up to three times.
    void event(std::int64_t time_ns, const std::string& cause);
    bool pending() const { return since_.has_value(); }
    std::int64_t begin_ns() const { return *since_ - last_ns_; }
    std::int64_t end_ns() const { return end_; }
    const std::string& cause() const { return cause_; }
    void done() { since_.reset(); }

private:
    const std::int64_t last_ns_, after_ns_;
    std::optional<std::int64_t> since_;
    std::int64_t end_ = 0;
    std::string cause_;
};

/// Returns BASE-20261126T124501Z-CAUSE-SEQ.ENDING.
std::string flight_name(const std::string& file, std::int64_t unix_ns, const std::string& cause, unsigned number);

}  // namespace hal::tools
