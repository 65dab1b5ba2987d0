// SPDX-License-Identifier: MIT
// Measures the path delay to the master (RTnet, Documentation/TDMA): rounds of a request and a
// reply in the station's own slot, and their median. One round is pending at a time; without an
// answer in time it is repeated.
//
//     delay = ((received reply - sent request) (1 + drift) - (sent reply - received request)) / 2
#pragma once

#include <array>

#include "station_setup.hpp"

namespace hal::tdma {

class Calibration {
public:
    static constexpr std::uint32_t max_rounds = 250;

    /// Starts a calibration of 1..250 rounds. [realtime]
    void begin(std::uint32_t rounds) noexcept;
    /// Ends the calibration without a result. [realtime]
    void end() noexcept { active_ = waiting_ = false; }
    bool active() const noexcept { return active_; }
    /// Returns true when a request may be sent in this cycle: none is pending, or the last one
    /// timed out. [realtime]
    bool due(std::uint32_t cycle, std::uint32_t period) noexcept;
    /// Notes a request; the master answers in `reply_cycle`. Times are local, ns. [realtime]
    void sent(std::uint32_t reply_cycle, Time not_before, Time reply_at) noexcept;
    /// Returns true when the master uses the slot of this cycle for its reply. [realtime]
    bool reserved(std::uint32_t cycle) const noexcept { return waiting_ && cycle == reply_cycle_; }
    /// Evaluates a reply. Returns true when it completed the last round; delay() is the result.
    /// Ignores a reply later than `tolerance` (ns) after its slot. [realtime]
    bool accept(const Reply&, Time arrived, double drift, Time tolerance) noexcept;
    /// Drops the pending round, after a change of the master. [realtime]
    void forget() noexcept { waiting_ = false; }

    Time delay() const noexcept { return delay_; }  ///< one way, ns
    std::uint32_t done() const noexcept { return done_; }
    /// requests without a reply
    std::uint32_t unanswered() const noexcept { return unanswered_; }
    /// of them, since the last reply
    std::uint32_t unanswered_row() const noexcept { return unanswered_row_; }

private:
    bool active_ = false;
    bool waiting_ = false;
    std::uint32_t rounds_ = 0;
    std::uint32_t done_ = 0;
    std::uint32_t reply_cycle_ = 0;
    std::uint32_t unanswered_ = 0;
    std::uint32_t unanswered_row_ = 0;
    Time not_before_ = 0;  // local; the request left no earlier
    Time reply_at_ = 0;  // local time of the reply's slot
    Time delay_ = 0;
    std::array<Time, max_rounds> measured_{};
};

}  // namespace hal::tdma
