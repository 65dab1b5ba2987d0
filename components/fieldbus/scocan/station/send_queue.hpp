// SPDX-License-Identifier: MIT
// The frames that a node has to send, in order of their priority on the bus. A frame stays until
// its echo proves that it was sent.
#pragma once

#include <array>
#include <cstddef>

#include "fieldbus/scocan/config/table.hpp"
#include "link/can.hpp"

namespace hal::scocan {

inline constexpr std::uint32_t no_slot = UINT32_MAX;

class SendQueue {
public:
    static constexpr std::size_t capacity = 128;
    struct Entry {
        can::Frame frame;
        std::uint32_t slot = no_slot;  ///< requested private slot
        bool priv = false;             ///< leaves in private slots only
        bool state = false;            ///< a value: a newer one replaces it
        bool in_flight = false;
        Time until = 0;                ///< in flight: when its slot has ended
        Time planned = INT64_MIN;  ///< in flight: time of the call that handed it over
    };

    /// Queues a frame behind those of the same priority. Returns false when full. [realtime]
    bool push(const can::Frame&, std::uint32_t slot, bool priv, bool state) noexcept;
    /// Removes waiting values of an identifier. [realtime]
    void withdraw(std::uint32_t id) noexcept;
    /// Returns the next waiting frame that `fits`, or nullptr. [realtime]
    template <class Fits>
    Entry* next(Fits fits) noexcept {
        for (std::size_t i = 0; i < size_; ++i) {
            if (!entries_[i].in_flight && fits(entries_[i])) return &entries_[i];
        }
        return nullptr;
    }
    /// Returns the newest value of an identifier that was handed over in the call at `planned`, or
    /// nullptr. [realtime]
    Entry* handed_over(std::uint32_t id, Time planned) noexcept;
    /// Removes the frame in flight that was echoed. Returns false without such a frame; `sent` is a
    /// copy. [realtime]
    bool confirm(const can::Frame&, Entry& sent) noexcept;
    /// Ends the flight of frames whose slot is over: they wait again. Returns how many private ones
    /// missed theirs. [realtime]
    std::uint32_t expire(Time now) noexcept;
    void clear() noexcept { size_ = 0; }  ///< [realtime]
    /// Removes waiting frames with an identifier below `limit`. Returns how many. [realtime]
    std::size_t drop_waiting(std::uint32_t limit) noexcept;
    std::size_t size() const noexcept { return size_; }
    bool flying() const noexcept;  ///< Returns true while a frame is in flight. [realtime]

private:
    void remove(std::size_t index) noexcept;
    std::array<Entry, capacity> entries_;
    std::size_t size_ = 0;
};

}  // namespace hal::scocan
