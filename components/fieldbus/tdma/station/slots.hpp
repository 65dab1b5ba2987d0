// SPDX-License-Identifier: MIT
// The slots of a station and their transmit queues. Memory is allocated in the constructor.
#pragma once

#include <array>
#include <memory>
#include <span>

#include "station_setup.hpp"

namespace hal::tdma {

inline constexpr unsigned unused_slot = ~0U;  ///< id of a slot that the schedule does not use

/// A slot with its queue.
class Slot {
public:
    /// Allocates a queue of `queue` frames. [setup]
    explicit Slot(const SlotSetup& setup, std::size_t queue);

    const SlotSetup& setup() const noexcept { return setup_; }
    /// Changes the slot and empties its queue. [realtime]
    void change(const SlotSetup& setup) noexcept {
        setup_ = setup;
        clear();
    }
    /// Returns true when the slot is used in this cycle.
    bool used_in(std::uint32_t cycle) const noexcept {
        return setup_.id != unused_slot && cycle % setup_.period == setup_.phasing;
    }
    std::size_t room() const noexcept { return setup_.size; }  ///< bytes behind the Ethernet header
    /// Bytes on the line that all frames of one turn may take together.
    std::size_t turn_bytes() const noexcept {
        return ethernet::wire_bytes(ethernet::header_bytes + setup_.size);
    }

    /// Queues a copy of the frame. Returns false when it is too long, or when frames of at least
    /// its priority already fill the next turn: a longer queue would delay everything by a cycle
    /// after each missed turn. [realtime]
    bool push(std::span<const std::uint8_t> frame, unsigned priority,
              ethernet::Finisher* finisher = nullptr) noexcept;
    /// Returns the oldest frame of the highest priority; empty: none. Valid until the next push().
    /// [realtime]
    std::span<const std::uint8_t> front() const noexcept;
    ethernet::Finisher* finisher() const noexcept;  ///< of front(). [realtime]
    void pop() noexcept;  ///< removes front(). [realtime]
    void clear() noexcept;  ///< empties the queue. [realtime]
    std::size_t waiting() const noexcept { return waiting_; }

private:
    struct Place {
        std::uint32_t length = 0;  // 0: free
        std::uint32_t priority = 0;
        std::uint64_t order = 0;
        ethernet::Finisher* finisher = nullptr;
        std::array<std::uint8_t, ethernet::largest_frame> bytes;
    };
    std::size_t most_urgent() const noexcept;
    std::size_t ahead_of(unsigned priority) const noexcept;  // bytes on the line

    SlotSetup setup_;
    std::size_t count_ = 0;
    std::size_t waiting_ = 0;
    std::uint64_t order_ = 0;
    std::unique_ptr<Place[]> places_;
};

}  // namespace hal::tdma
