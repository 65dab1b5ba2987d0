// SPDX-License-Identifier: MIT
// Begin and period of the cycle in a node's own time, estimated from the arrival of the SYNCs.
// Every cycle p += P; with a SYNC, e = stamp - p, p += a e, P += b e, a = 0.3, b = 0.03; a lost
// SYNC leaves p as predicted. The first two stamps give p and P. A SYNC further off than 5 sigma is
// rejected twice; the third in a row is a new phase.
#pragma once

#include <cstdint>

#include "fieldbus/scocan/config/table.hpp"

namespace hal::scocan {

class CycleClock {
public:
    /// `floor`: deviation, ns, that is never rejected: the resolution of the stamps and some bits.
    CycleClock(Time nominal, Time floor) noexcept
        : nominal_(static_cast<double>(nominal)),
          per_nominal_(1 / nominal_),
          floor_(static_cast<double>(floor)) {
        clear();
    }

    /// off_rate: the interval of two SYNCs differs by more than 1000 ppm from the cycle; the
    /// estimate begins anew.
    enum class Accepted : std::uint8_t { first, good, rejected, duplicate, jumped, off_rate };

    void clear() noexcept;  ///< Discards the estimate. [realtime]
    /// Begins a cycle of the nominal period at `begin`, without a SYNC of others. [realtime]
    void lead(Time begin) noexcept;
    /// Uses the stamp of a SYNC: the begin of its cycle. [realtime]
    Accepted accept(Time stamp) noexcept;
    /// Lets the next SYNC have any phase, after a time in which the prediction has become too
    /// inaccurate. [realtime]
    void accept_any_phase() noexcept { rejected_ = max_rejected; }
    /// Notes that the SYNC of this cycle was sent by this node: it keeps its time. [realtime]
    void own(Time stamp) noexcept;
    /// Begins the cycles whose SYNC is `wait` overdue at `now`. Returns how many. [realtime]
    std::uint32_t pass(Time now, Time wait) noexcept;

    bool known() const noexcept { return accepted_ >= 2; }
    /// a first SYNC has arrived: start()
    bool heard() const noexcept { return accepted_ >= 1; }
    std::uint32_t lost() const noexcept { return lost_; }  ///< SYNCs lost in a row
    /// the SYNC of the current cycle has arrived
    bool seen() const noexcept { return seen_; }
    std::uint64_t cycle() const noexcept { return cycle_; }  ///< cycles begun so far
    /// Returns the time `offset` (nominal ns) after the start of cycle `cycle`. [realtime]
    Time at(std::uint64_t cycle, Time offset) const noexcept;
    Time start() const noexcept { return at(cycle_, 0); }
    double period() const noexcept { return period_; }  ///< ns of this node's clock
    double error() const noexcept { return error_; }  ///< of the last SYNC, ns
    double sigma() const noexcept;  ///< rms of the errors, ns
    /// deviation of the last interval that was off_rate
    double off_ppm() const noexcept { return off_ * 1e6; }
    /// rate of this clock against that of the SYNC's sender
    double ppm() const noexcept { return (period_ / nominal_ - 1) * 1e6; }

private:
    void advance(std::uint32_t cycles) noexcept;

    static constexpr std::uint32_t max_rejected = 2;  // in a row; the next one is a new phase

    const double nominal_, per_nominal_, floor_;
    Time epoch_ = 0;  // p_ counts from here, so that it keeps fractions of a nanosecond
    double p_ = 0;
    double period_ = 0;
    double error_ = 0;
    double square_ = 0;
    double off_ = 0;
    std::uint32_t accepted_ = 0;
    std::uint32_t lost_ = 0;
    std::uint32_t rejected_ = 0;
    bool seen_ = false;
    std::uint64_t cycle_ = 0;
};

}  // namespace hal::scocan
