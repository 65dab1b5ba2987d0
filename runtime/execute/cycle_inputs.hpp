// SPDX-License-Identifier: MIT
// What a thread reads in a cycle and does not compute: the seam between a live cycle, its journal
// and its re-execution (docs/internals/journal.md).
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

namespace hal {

/// The inputs of one cycle, or of one turn between two cycles, as words of 64 bits.
struct CycleRecord {
    enum Kind : std::uint64_t {
        cycle,
        service,  ///< Core::service(), in which something happened
    };
    std::uint64_t kind = cycle;
    std::uint64_t lost = 0;  ///< records of the thread that did not fit, before this one
    std::uint64_t number = 0;  ///< of the cycle
    std::int64_t grid_ns = 0;
    std::int64_t due_ns = 0;
    std::int64_t woke_ns = 0;
    std::uint64_t missed = 0;  ///< periods without a cycle, before this one
    std::uint64_t epoch = 0;  ///< of the plan that it took; 0: it took none
    /// session's writes that were applied before the plan was taken, and at the end: totals
    std::uint64_t writes_before = 0;
    std::uint64_t writes_after = 0;
    std::uint64_t observation = 0;  ///< the numbered observation that it answered; 0: none
    std::uint64_t checksum = 0;  ///< of values of the thread at the end
    std::uint64_t imports = 0;  ///< so many of the notes are the finished cycles it read
    std::uint64_t notes = 0;  ///< how many words follow
    std::uint64_t data = 0;  ///< so many of the notes, the last ones, are bytes of results
};

/// The order in which functions that share state ran in a journaled machine.
class FunctionOrder {
public:
    virtual ~FunctionOrder() = default;
    /// Returns when all steps with smaller tickets have run. Other cycles are executed meanwhile.
    /// `covered`: what functions read of each other while both ran is in the journal.
    virtual void wait_for(std::uint64_t ticket, bool covered) = 0;
    /// The same for calls that were made one at a time, whose tickets are a sequence of their own.
    virtual void wait_for_call(std::uint64_t ticket) = 0;
};

/// Records the inputs of the cycles of one thread, or gives them back. [realtime] for the thread,
/// unless stated otherwise.
///
/// Recording, the words are in a ring that one reader empties:
///   1. thread stores the words at head   2. thread publishes head + words (release)
///   3. reader sees head (acquire), copies   4. reader publishes tail (release)
/// A record that does not fit is dropped and counted; the thread never waits.
class CycleInputs {
public:
    static constexpr std::size_t head_words = sizeof(CycleRecord) / sizeof(std::uint64_t);
    /// of one cycle; a cycle that reads more is dropped like one that does not fit
    static constexpr std::size_t max_notes = 8192;

    /// Records, in a ring of at least `ring_words`, which is touched here. [setup]
    explicit CycleInputs(std::size_t ring_words);
    /// Gives back what load() is given, in this order, which outlives it. [setup]
    explicit CycleInputs(FunctionOrder* order = nullptr);
    CycleInputs(const CycleInputs&) = delete;

    bool replays() const noexcept { return ring_ == nullptr; }
    const CycleRecord& record() const noexcept { return record_; }

    // --- by the thread, in this order ------------------------------------------------------------
    void begin(CycleRecord::Kind kind, std::uint64_t number, std::int64_t grid_ns,
               std::int64_t due_ns, std::int64_t woke_ns, std::uint64_t missed) noexcept;
    /// The plan with this epoch was taken, or none (0), after `writes` writes.
    void took(std::uint64_t epoch, std::uint64_t writes) noexcept;
    /// The next `count` notes are the finished cycles of other threads that it reads.
    void reads(std::uint64_t count) noexcept;
    /// Notes a value that was read. Returns the value to be used: in a re-execution the one that
    /// was read in the journaled cycle.
    std::uint64_t note(std::uint64_t value) noexcept {
        const std::size_t at = count_++;
        if (replays()) return at < record_.notes - record_.data ? notes_[at] : value;
        if (at < max_notes) {
            notes_[at] = value;
        }
        return value;
    }
    /// Only in a re-execution.
    void wait_for_turn(std::uint64_t ticket, bool covered) {
        if (order_) {
            order_->wait_for(ticket, covered);
        }
    }
    /// Appends the result of a call, or gives it back. A re-execution may ask for more than the
    /// journaled cycle had: then it returns false, with zeros in `bytes`.
    void put(const void* bytes, std::size_t size) noexcept;
    bool get(void* bytes, std::size_t size) noexcept;
    /// Notes the ticket of a call; in a re-execution, waits for it.
    void order_call(std::uint64_t ticket) noexcept;
    /// In a re-execution: `link` has sent other frames than in the journaled cycle. The text
    /// outlives the cycle.
    void differs(const char* link) noexcept {
        if (!differing_link_) {
            differing_link_ = link;
        }
    }
    void answered(std::uint64_t observation) noexcept { record_.observation = observation; }
    /// Ends the record; in a re-execution, compares it.
    void end(std::uint64_t writes, std::uint64_t checksum) noexcept;
    /// Forgets what was noted since begin().
    void drop() noexcept {
        count_ = 0;
        data_bytes_ = 0;
    }

    /// Returns the record whose words begin at `words`; its notes follow. [any]
    static CycleRecord record_at(const std::uint64_t* words) noexcept;

    // --- by the reader of the ring ---------------------------------------------------------------
    /// Appends the words of all complete records to `to`, a vector of words. [any]
    template <class Words>
    void take(Words& to) {
        const std::size_t head = head_.load(std::memory_order_acquire);
        for (std::size_t at = tail_.load(std::memory_order_relaxed); at != head; ++at) {
            to.push_back(ring_[at & mask_]);
        }
        tail_.store(head, std::memory_order_release);
    }
    /// Returns how many records were dropped. [any]
    std::uint64_t lost() const noexcept { return lost_.load(std::memory_order_acquire); }

    // --- by the re-execution, between two cycles -------------------------------------------------
    /// Sets the record of the next cycle. At most max_notes notes.
    void load(const CycleRecord& record, std::span<const std::uint64_t> notes);
    const std::uint64_t* notes() const noexcept { return notes_.get(); }
    /// From now on the machine is another one: what was noted of its own state is ignored.
    void ignore_state() noexcept { has_state_ = false; }
    bool has_state() const noexcept { return has_state_; }
    enum class Match : std::uint8_t {
        same,
        other_reads,  ///< the cycle has read more or less than the journaled one
        other_values,
        other_frames,  ///< a link has sent other frames: differing_link()
    };
    /// Returns how the last cycle compares with its record.
    Match match() const noexcept { return match_; }
    const char* differing_link() const noexcept { return differing_link_; }

private:
    void put_record() noexcept;

    CycleRecord record_;
    std::size_t count_ = 0;  // of notes
    bool has_state_ = true;
    std::unique_ptr<std::uint64_t[]> notes_;
    std::size_t data_bytes_ = 0;  // of results, that were put or got
    std::unique_ptr<std::uint64_t[]> data_;
    std::uint64_t last_call_ = 0;  // ticket of the newest call in this cycle, and one more
    bool asked_too_much_ = false;
    const char* differing_link_ = nullptr;
    Match match_ = Match::same;
    FunctionOrder* const order_ = nullptr;
    const std::size_t mask_;
    const std::unique_ptr<std::uint64_t[]> ring_;  // nullptr: replays
    std::size_t seen_tail_ = 0;
    alignas(64) std::atomic<std::size_t> head_{0};  // written by the thread
    std::atomic<std::uint64_t> lost_{0};  // written by the thread
    alignas(64) std::atomic<std::size_t> tail_{0};  // written by the reader
};

}  // namespace hal
