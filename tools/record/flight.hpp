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
    static constexpr std::size_t max_bytes = std::size_t{512} << 20;

    FlightMemory(std::vector<ProbeGroup> groups, std::int64_t last_ns) : last_ns_(last_ns) {
        layout(std::move(groups));
    }

    void layout(std::vector<ProbeGroup> groups);
    void add(ProbeBatch&& batch);
    void add(const ProbeClient::Entry& entry) { entries_.push_back(entry); }
    /// Writes the samples and entries between the two times. Returns false after a failed write.
    bool write(Sink& sink, std::int64_t begin_ns, std::int64_t end_ns, std::uint64_t& rows) const;
    /// Forgets what is older than the time to be kept, reckoned from `now_ns`; nothing after
    /// `but_from_ns`.
    void prune(std::int64_t now_ns, std::int64_t but_from_ns);
    std::size_t bytes() const { return bytes_; }
    /// Returns the time up to which nothing is left.
    std::int64_t forgotten_until_ns() const { return forgotten_until_ns_; }

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
    std::int64_t forgotten_until_ns_ = INT64_MIN;
};

/// Decides when a file is written and what it is called.
class FlightTrigger {
public:
    FlightTrigger(std::int64_t last_ns, std::int64_t after_ns)
        : last_ns_(last_ns), after_ns_(after_ns) {}

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

/// An event whose file is not complete.
struct FlightEvent {
    std::int64_t begin_ns = 0;
    std::int64_t time_ns = 0;
    std::int64_t end_ns = 0;
    std::string cause;
    std::string path;  ///< of the first attempt to write it
};

/// The events that could not be written yet: they stay in memory until there is space again.
class FlightBacklog {
public:
    static constexpr std::size_t max_events = 1000;

    explicit FlightBacklog(std::string folder) : folder_(std::move(folder)) {}

    /// Adds an event; beyond the limit it is only counted.
    void add(FlightEvent event);
    bool empty() const { return events_.empty(); }
    FlightEvent& oldest() { return events_.front(); }
    std::size_t size() const { return events_.size(); }
    std::uint64_t lost() const { return lost_; }
    /// Returns the time from which the memory is still needed.
    std::int64_t needed_from_ns() const {
        return events_.empty() ? INT64_MAX : events_.front().begin_ns;
    }
    /// Counts the events of which nothing is left in memory as lost.
    void forget(std::int64_t until_ns);

    /// The oldest event was written.
    void written();
    /// It was not. Returns true for the first failure since the last success.
    bool failed(std::int64_t now_ns);
    /// Returns whether an attempt may succeed: nothing has failed, the disk has more space than at
    /// the failure, or half a minute has passed.
    bool may_write(std::int64_t now_ns);
    /// After a success that ends an outage: returns its line, once.
    std::string recovered();

private:
    std::uint64_t free_bytes() const;

    const std::string folder_;
    std::deque<FlightEvent> events_;
    std::uint64_t lost_ = 0;
    std::uint64_t late_ = 0;  // of this outage: lost, written late
    std::uint64_t free_at_failure_ = 0;
    std::int64_t failed_ns_ = 0;
    std::int64_t looked_ns_ = 0;
    bool failing_ = false;
};

/// Returns BASE-20261126T124501Z-CAUSE-SEQ.ENDING.
std::string flight_name(const std::string& file, std::int64_t unix_ns, const std::string& cause,
                        unsigned number);

}  // namespace hal::tools
