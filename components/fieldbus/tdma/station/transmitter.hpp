// SPDX-License-Identifier: MIT
// What a station sends: syncs, the answers of a master to calibration requests, and in its slots
// calibration requests, queued frames and pings.
#pragma once

#include <array>
#include <atomic>
#include <deque>

#include "calibration.hpp"
#include "pings.hpp"
#include "roster.hpp"
#include "slots.hpp"
#include "station_core.hpp"

namespace hal::tdma {

/// Sends syncs, answers, requests, and the frames and pings of the slots. [realtime]
class Transmitter {
public:
    /// A slot that a frame is for, and the epoch in which it was found: see slots.hpp.
    struct Target {
        std::uint32_t epoch = 0;
        Slot* slot = nullptr;  ///< nullptr: this station has no such slot
    };
    /// All must outlive it. [setup]
    Transmitter(StationCore& core, Calibration& calibration, Pings& pings,
                const Roster& roster) noexcept
        : core_(core), calibration_(calibration), pings_(pings), roster_(roster) {}
    /// Allocates the slots of the setup. [setup]
    void set_up();
    /// Changes the slots and drops all queued frames. Returns false when there are more slots than
    /// were allocated.
    bool change(std::span<const SlotSetup>) noexcept;
    /// Starts anew: drops the requests that wait for an answer.
    void restart() noexcept;
    /// Drops all queued frames, also those that another thread is about to queue for a target that
    /// it has found.
    void clear_slots() noexcept;

    /// Queues the answer to a calibration request, one per station.
    void queue_reply(const Decoded&, Time arrived) noexcept;
    /// Sends requests in every n-th cycle only, besides frames; 0: in every cycle.
    void recalibrate_every(std::uint32_t cycles) noexcept { recalibration_ = cycles; }
    /// Sends every frame that is due within the next cycle, in order of time. `backup_sync`: a
    /// backup leads, and the sync of this cycle has not come.
    void transmit(Time now, bool backup_sync) noexcept;

    const Slot* find(unsigned id) const noexcept;
    /// Finds the slot for a frame. A sender must check after that whether it may send. [any]
    Target target(unsigned id) noexcept;
    const std::deque<Slot>& slots() const noexcept { return slots_; }

private:
    struct Reply {
        Address to{};
        Time stamp = 0;
        Time received = 0;
        Time offset = 0;
        std::uint32_t cycle = 0;
        bool used = false;
    };
    /// A frame that has left its queue.
    struct Outgoing {
        std::array<std::uint8_t, ethernet::max_frame> bytes;
        std::size_t length = 0;
        ethernet::Finisher* finisher = nullptr;
    };
    /// A slot, or the sync, that is due.
    struct Turn {
        Time at;
        std::size_t index;  // slots_.size(): the sync
        std::uint32_t cycle;
    };
    static constexpr std::size_t max_turns = 4 * (max_slots + 1);

    std::span<Turn> due_turns(std::array<Turn, max_turns>&, Time from, Time until) const noexcept;
    /// Passes a frame to the port, which counts it when it drops it. Returns false when it does so
    /// at once.
    bool launch(std::span<const std::uint8_t> frame, const ethernet::Launch&) noexcept;
    void send_sync(std::uint32_t cycle, Time global_at) noexcept;
    void send_replies() noexcept;
    void send_slot(std::size_t index, std::uint32_t cycle) noexcept;
    bool take(Slot&, std::size_t space) noexcept;
    bool calibrates(const Slot&, std::uint32_t cycle, Time local_at) noexcept;
    void send_request(const Slot&, std::uint32_t cycle, Time local_at) noexcept;
    void send_pings(const Slot&, Time local_at, std::size_t used) noexcept;
    bool send_answer(Time local_at) noexcept;
    bool send_ping(Time local_at) noexcept;
    Address ping_target(std::size_t n) const noexcept;
    Reply* reply_to(const Address&) noexcept;
    /// Returns how far ahead transmit() sends: slightly more than a cycle, because the next sync is
    /// one cycle ahead and the thread is never exactly in phase; not more, because a port without a
    /// pacer sends a slot right after the thread when it is due, not a cycle before.
    Time reach() const noexcept {
        const Time cycle = core_.setup.cycle;
        return core_.setup.lead + cycle + std::min<Time>(cycle / 32, 31'250);
    }
    Time local_now() const noexcept { return core_.status.global - core_.status.offset; }

    StationCore& core_;
    Calibration& calibration_;
    Pings& pings_;
    const Roster& roster_;
    std::deque<Slot> slots_;  // in the order of the setup: calibration uses the first
    std::atomic<std::uint32_t> epoch_{0};  // of the slots; written by the station's thread
    Outgoing outgoing_{};  // what take() has taken
    std::array<Reply, 64> replies_{};  // as many as RTnet's master
    Time sent_until_ = 0;  // global; slots up to here are done
    bool sent_any_ = false;
    std::uint32_t recalibration_ = 0;
};

}  // namespace hal::tdma
