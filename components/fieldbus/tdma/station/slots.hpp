// SPDX-License-Identifier: MIT
// The slots of a station and their transmit queues. Memory is allocated in the constructor.
//
// Any thread may push frames; everything else is of the thread of the station. An entry passes from
// one to the other by its state:
//
//     free --push()--> filling --push()--> ready --pop(), clear()--> free
//
// push() claims a free entry by an exchange of the state, so two threads never fill the same one.
// The station's thread reads an entry only while it is ready. Two threads that push at the same
// time may both find space in the next turn: then one of the frames leaves in the turn after it.
//
// The number of frames is raised before an entry becomes ready, because the station's thread stops
// its search when the number is 0. Otherwise, A more urgent than B:
//
//     thread of A              thread of B              station
//     1. A is ready
//     2. (preempted)           B is ready, number 1
//     3.                                                front() returns A; pop(): number 0
//     4.                                                front() finds nothing: B misses its turn
//     5. number 1
//
// clear() begins an epoch. A sender reads the epoch before it checks whether it may send, and
// push() writes it into the entry. The station's thread drops a frame of an earlier epoch:
//
//     sender                                            station
//     1. reads epoch 1
//     2. the station is ready
//     3. (preempted)                                    loses the sync: not ready
//     4.                                                clear(): epoch 2; this entry is free
//     5.                                                new sync: ready
//     6. A is ready, of epoch 1
//     7.                                                front() frees A and returns another frame
//
// The station stores `not ready`, and the setup of a slot, before the new epoch (release). A sender
// that reads the new epoch (acquire) therefore reads them, too.
#pragma once

#include <array>
#include <atomic>
#include <memory>
#include <span>
#include <utility>

#include "station_setup.hpp"

namespace hal::tdma {

inline constexpr unsigned unused_slot = ~0U;  ///< id of a slot that the schedule does not use

/// A slot with its queue.
class Slot {
public:
    /// Allocates a queue of `queue` frames. [setup]
    explicit Slot(const SlotSetup& setup, std::size_t queue);

    const SlotSetup& setup() const noexcept { return setup_; }
    unsigned id() const noexcept { return id_.load(std::memory_order_relaxed); }  ///< [any]
    /// Changes the slot; clear() must follow. [realtime]
    void change(const SlotSetup& setup) noexcept {
        setup_ = setup;
        id_.store(setup.id, std::memory_order_relaxed);
        size_.store(setup.size, std::memory_order_relaxed);
    }
    /// Returns true when the slot is used in this cycle.
    bool used_in(std::uint32_t cycle) const noexcept {
        return setup_.id != unused_slot && cycle % setup_.period == setup_.phasing;
    }
    /// bytes behind the Ethernet header [any]
    std::size_t capacity() const noexcept { return size_.load(std::memory_order_relaxed); }
    /// Bytes on the line that all frames of one turn may take together. [any]
    std::size_t turn_bytes() const noexcept {
        return ethernet::wire_bytes(ethernet::header_bytes + capacity());
    }

    /// Queues a copy of the frame. Returns false when it is too long, or when frames of at least
    /// its priority already fill the next turn: a longer queue would delay everything by a cycle
    /// after each missed turn. A frame of an earlier epoch is dropped later. [any, realtime]
    bool push(std::span<const std::uint8_t> frame, unsigned priority,
              ethernet::Finisher* finisher, std::uint32_t epoch) noexcept;
    /// Returns the oldest frame of the highest priority; empty: none. Valid until the next pop() or
    /// clear(). Drops frames of earlier epochs. [realtime]
    std::span<const std::uint8_t> front() noexcept;
    /// Returns the finisher of the frame that front() returned last. [realtime]
    ethernet::Finisher* finisher() const noexcept;
    /// Removes the frame that front() has returned last, also when a more urgent one has been
    /// pushed meanwhile. [realtime]
    void pop() noexcept;
    /// Empties the queue, which then accepts frames of this epoch only. [realtime]
    void clear(std::uint32_t epoch) noexcept;
    /// Returns how many frames front() and clear() have dropped since the last call. [realtime]
    std::uint64_t take_dropped() noexcept { return std::exchange(dropped_, 0); }
    std::size_t waiting() const noexcept { return waiting_.load(std::memory_order_relaxed); }

private:
    enum class State : std::uint8_t { free, filling, ready };
    struct Entry {
        std::atomic<State> state{State::free};
        // other threads that push read these three at any time
        std::atomic<std::uint32_t> length{0}, priority{0}, epoch{0};
        std::uint64_t order = 0;
        ethernet::Finisher* finisher = nullptr;
        std::array<std::uint8_t, ethernet::max_frame> bytes;

        bool is_ready() const noexcept {
            return state.load(std::memory_order_acquire) == State::ready;
        }
    };
    std::size_t max_urgent() noexcept;
    // bytes on the line
    std::size_t ahead_of(unsigned priority, std::uint32_t epoch) const noexcept;
    bool release(Entry& entry) noexcept;
    void drop(Entry& entry) noexcept;

    SlotSetup setup_;  // of the station's thread
    std::uint32_t epoch_ = 0;  // of the station's thread
    std::uint64_t dropped_ = 0;  // of the station's thread
    std::atomic<unsigned> id_;
    std::atomic<std::uint32_t> size_;
    std::size_t count_ = 0;
    std::size_t front_ = 0;  // what front() has returned; count_: none
    std::atomic<std::size_t> waiting_{0};  // frames that are ready, or become so at once
    std::atomic<std::uint64_t> order_{0};
    std::unique_ptr<Entry[]> entries_;
};

}  // namespace hal::tdma
