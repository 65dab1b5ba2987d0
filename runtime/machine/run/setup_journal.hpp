// SPDX-License-Identifier: MIT
// What components get from outside while they are constructed, started and stopped: recorded for
// the journal, or given back in a re-execution (docs/internals/journal.md).
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "execute/cycle_schedule.hpp"
#include "machine/report/journaled_calls.hpp"
#include "machine/run/acquisition.hpp"

namespace hal {

class ExecutionSink;
struct Instance;

/// [setup] throughout, with the session's lock held. There is one at a time in a process.
class SetupJournal final : public SetupReader {
public:
    /// `schedule`: gives back what was recorded; nullptr: records.
    explicit SetupJournal(CycleSchedule* schedule);
    ~SetupJournal() override;
    SetupJournal(const SetupJournal&) = delete;

    /// Returns the one that takes the results of the calling thread, which makes a setup call;
    /// nullptr: none.
    static SetupJournal* current() noexcept;

    bool replays() const { return schedule_ != nullptr; }
    /// Returns false where a re-execution has no results, or no more of them.
    bool begin_call();
    void put(const void* bytes, std::size_t size);
    bool get(void* bytes, std::size_t size);
    void order_call(std::uint64_t ticket);
    /// The readings are those of a driver. Returns what it was before.
    bool hide_readings(bool hidden);

    /// The instance that is started next.
    void begin_start(const Instance& instance) { starting_ = &instance; }
    /// What a link acquires between these two calls has its results in the journal, and so have the
    /// streams that the instance publishes.
    void begin_link();
    void end_link();
    /// Returns what was acquired by links since the last call.
    OutsideWorld take_acquired() { return std::exchange(acquired_, {}); }

    /// The transaction has taken effect: what its calls got goes to the sink.
    void flush(ExecutionSink& sink);
    /// Returns the tickets of the ordered calls that the transaction has made.
    const std::vector<std::uint64_t>& ordered_calls() const { return ordered_; }
    /// The transaction was rejected, and has left nothing.
    void forget();

    // SetupReader
    std::int64_t reading(std::int64_t value) override;
    int opened(const char* path, int (*open_now)(const char*, int), int flags) override;

private:
    int record_file(const char* path, int descriptor);
    static int descriptor_of(const SetupFile& file);

    CycleSchedule* const schedule_;
    std::int64_t call_since_ns_ = 0;  // identifies the call
    SetupResults results_;  // of the call that is executed again
    std::size_t links_at_ = 0;
    std::size_t readings_at_ = 0;
    bool has_results_ = false;
    bool hidden_ = false;
    std::vector<SetupResults> calls_;
    std::vector<std::uint64_t> ordered_;  // tickets of the transaction
    std::vector<SetupFile> files_;
    const Instance* starting_ = nullptr;
    std::optional<Acquisition> before_link_;
    std::size_t streams_before_link_ = 0;
    OutsideWorld acquired_;
};

}  // namespace hal
