// SPDX-License-Identifier: MIT
// The slots of a station and the frames that wait for them. Memory is taken in the constructor.
#pragma once

#include <array>
#include <memory>
#include <span>

#include "station_setup.hpp"

namespace hal::tdma {

inline constexpr unsigned unused_slot = ~0U;  ///< id of one that a station does not have now

class Slot {
public:
    explicit Slot(const SlotSetup& setup, std::size_t queue);

    const SlotSetup& setup() const noexcept { return setup_; }
    /// Another slot with the same queue, which is emptied. [realtime]
    void change(const SlotSetup& setup) noexcept { setup_ = setup, clear(); }
    bool used_in(std::uint32_t cycle) const noexcept { return setup_.id != unused_slot && cycle % setup_.period == setup_.phasing; }
    std::size_t room() const noexcept { return setup_.size; }  ///< bytes behind the Ethernet header
    /// Bytes of the wire that all frames of a turn have together.
    std::size_t turn_bytes() const noexcept { return ethernet::wire_bytes(ethernet::header_bytes + setup_.size); }

    /// Copies it. False: the frame is too long, or the next turn belongs to frames that are as urgent already. More must not wait here: after
    /// a turn that the thread missed, everything would be late by a cycle for ever. [realtime]
    bool push(std::span<const std::uint8_t> frame, unsigned priority, ethernet::Finisher* finisher = nullptr) noexcept;
    /// The most urgent, and among them the oldest; empty: none waits. Valid until the next push(). [realtime]
    std::span<const std::uint8_t> front() const noexcept;
    ethernet::Finisher* finisher() const noexcept;  ///< of front(). [realtime]
    void pop() noexcept;    ///< [realtime]
    void clear() noexcept;  ///< [realtime]
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
    std::size_t ahead_of(unsigned priority) const noexcept;  // bytes of the wire

    SlotSetup                setup_;
    std::size_t              count_ = 0, waiting_ = 0;
    std::uint64_t            order_ = 0;
    std::unique_ptr<Place[]> places_;
};

}  // namespace hal::tdma
