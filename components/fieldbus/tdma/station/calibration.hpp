// SPDX-License-Identifier: MIT
// How long a frame is on its way to the master: rounds of a request and a reply in the station's own slot, and the median of what they
// say. One round is on its way at a time; one that is not answered in time is given up and repeated.
//
//     delay = ((received reply - sent request) (1 + drift) - (sent reply - received request)) / 2
#pragma once

#include <array>

#include "station_setup.hpp"

namespace hal::tdma {

class Calibration {
public:
    static constexpr std::uint32_t most_rounds = 250;

    /// [realtime]
    void begin(std::uint32_t rounds) noexcept;
    void end() noexcept { active_ = waiting_ = false; }  ///< what was measured by now counts nothing. [realtime]
    bool active() const noexcept { return active_; }
    /// A request may go out in this cycle: none is on its way, or the last was not answered. [realtime]
    bool due(std::uint32_t cycle, std::uint32_t period) noexcept;
    /// One goes out; the master answers in `reply_cycle`. Times are local. [realtime]
    void sent(std::uint32_t reply_cycle, Time not_before, Time reply_at) noexcept;
    /// The slot of this cycle is the master's, for its reply. [realtime]
    bool reserved(std::uint32_t cycle) const noexcept { return waiting_ && cycle == reply_cycle_; }
    /// True: it was the last round, and delay() is the result. A reply that comes later than `tolerance` after its slot is none. [realtime]
    bool take(const Reply&, Time arrived, double drift, Time tolerance) noexcept;
    /// What is on its way counts no more: another master. [realtime]
    void forget() noexcept { waiting_ = false; }

    Time          delay() const noexcept { return delay_; }
    std::uint32_t done() const noexcept { return done_; }
    std::uint32_t unanswered() const noexcept { return unanswered_; }         ///< in all
    std::uint32_t unanswered_row() const noexcept { return unanswered_row_; } ///< since the last reply

private:
    bool                          active_ = false, waiting_ = false;
    std::uint32_t                 rounds_ = 0, done_ = 0, reply_cycle_ = 0, unanswered_ = 0, unanswered_row_ = 0;
    Time                          not_before_ = 0;  // local time before which the request did not leave
    Time                          reply_at_ = 0;    // of the slot of the reply, local
    Time                          delay_ = 0;
    std::array<Time, most_rounds> measured_{};
};

}  // namespace hal::tdma
