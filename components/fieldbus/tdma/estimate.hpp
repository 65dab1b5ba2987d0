// SPDX-License-Identifier: MIT
// The global clock as a station sees it, estimated from syncs: global = local + offset, where the offset grows with the drift.
//
// An alpha-beta filter of the offsets that are measured, e = measured - predicted: offset += alpha e, drift += beta e / dt. It begins with
// the gains that weigh all measurements alike (a least-squares line) and ends with fixed ones, so that it follows a clock that warms up.
#pragma once

#include "setup.hpp"

namespace hal::tdma {

class ClockEstimate {
public:
    /// Starts anew. [realtime]
    void clear() noexcept { *this = {}; }
    /// The local clock is the global one, from here on. [realtime]
    void lead(Time local) noexcept;

    /// A sync, sent at `sent` (global), arrived at `arrived` (local), on its way for `delay`. False: so far off that it was not used.
    /// [realtime]
    bool take(Time sent, Time arrived, Time delay) noexcept;
    /// The delay was measured anew: it is `by` longer than what take() was told so far. [realtime]
    void delay_changed(Time by) noexcept { offset_ += static_cast<double>(by); }

    bool   known() const noexcept { return leading_ || taken_ >= 2; }
    bool   settled() const noexcept { return leading_ || taken_ >= 8; }
    Time   global(Time local) const noexcept;
    Time   local(Time global) const noexcept;
    Time   offset(Time local) const noexcept { return global(local) - local; }
    double drift() const noexcept { return drift_; }  ///< d offset / d local
    double jitter() const noexcept;                   ///< rms of what is not explained, ns

private:
    Time          base_ = 0;          // the offset's whole part: kept apart, for a double has 53 bits
    Time          at_ = 0;            // local time of `offset_`
    double        offset_ = 0.0, drift_ = 0.0;
    double        square_ = 0.0;      // mean square of e
    std::uint32_t taken_ = 0, outliers_ = 0;  // outliers: in a row, all early or all late
    bool          early_ = false, leading_ = false;
};

}  // namespace hal::tdma
