// SPDX-License-Identifier: MIT
// From a stream of samples to records: pre-trigger, trigger, modes. Time is the samples' own, so
// that it works on recorded data too.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "scope/samples.hpp"
#include "scope/trigger.hpp"

namespace hal::tools {

/// automatic: free-running records when no trigger comes; normal: keeps the last record until the
/// next trigger; single: one record, then stops; roll: no trigger, the newest samples.
enum class Mode { automatic, normal, single, roll };

/// filling: fewer samples than the time before the trigger
enum class State { stopped, filling, armed, triggered };

class Acquisition {
public:
    /// Times before and after the trigger, in ns, together at least 1.
    Acquisition(std::vector<Channel> channels, std::int64_t pre_ns, std::int64_t post_ns);

    /// nothing: as in roll mode, records without a trigger
    void set_trigger(const std::optional<Trigger>& trigger);
    void set_mode(Mode mode);
    void set_window(std::int64_t pre_ns, std::int64_t post_ns);
    void run();  ///< starts, or arms for the next single record
    void stop();
    void force();  ///< triggers now, if it runs

    /// Takes a sample of a channel. The times of a channel increase.
    void feed(std::size_t channel, Sample sample);
    /// No sample of any channel that was taken before `until_ns` will come: finishes what is
    /// complete.
    void progress(std::int64_t until_ns);
    /// Samples were lost: an edge across the gap is not one.
    void gap();

    State state() const { return state_; }
    Mode mode() const { return mode_; }
    const std::optional<Trigger>& trigger() const { return trigger_; }
    const std::vector<Channel>& channels() const { return channels_; }
    std::int64_t pre_ns() const { return pre_ns_; }
    std::int64_t post_ns() const { return post_ns_; }
    std::int64_t now_ns() const { return until_ns_; }
    /// Returns the newest finished record, or nullptr.
    const Record* record() const { return record_ ? &*record_ : nullptr; }
    std::uint64_t finished() const { return finished_; }  ///< number of records so far
    /// Returns what the trigger's source did so far: its search, or nullptr without a trigger.
    const TriggerSearch* search() const { return search_ ? &*search_ : nullptr; }
    /// Returns the newest samples, as long as a record.
    Record newest() const;

private:
    Record cut(std::int64_t begin_ns, std::int64_t end_ns) const;
    void arm();
    void finish(bool triggered);
    void trim();

    std::vector<Channel> channels_;
    std::vector<std::deque<Sample>> recent_;
    std::int64_t pre_ns_, post_ns_;
    Mode mode_ = Mode::automatic;
    State state_ = State::filling;
    std::optional<Trigger> trigger_;
    std::optional<TriggerSearch> search_;
    /// first_ns_: of the first sample since the start or the last gap
    std::int64_t first_ns_ = 0;
    std::int64_t until_ns_ = 0;
    std::int64_t armed_ns_ = 0;
    std::int64_t trigger_ns_ = 0;
    bool any_ = false;
    bool forced_ = false;
    std::optional<Record> record_;
    std::uint64_t finished_ = 0;
};

}  // namespace hal::tools
