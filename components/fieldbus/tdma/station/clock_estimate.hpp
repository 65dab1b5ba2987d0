// SPDX-License-Identifier: MIT
// The global clock as a station sees it, estimated from syncs: global = local + offset, where the offset grows with the drift.
//
// Two alpha-beta filters of the measured offsets, e = measured - predicted: offset += alpha e, drift += beta e / dt. Both begin with the
// gains that weigh all measurements alike (a least-squares line) and end with fixed ones. The short one (40 syncs) gives the offset and
// follows a step quickly; its slope scatters by sigma / dt / 240. The long one (seconds) gives the drift, which calibration, the user and a
// station that begins to lead need.
//
// Holdover: a station that begins to lead keeps the offset and the long average's drift, provided that the drift is known to 2 ppm, and
// otherwise the last one that was; with none it leads at its own crystal's rate. While it leads, the drift goes to zero, the station's own
// crystal, by at most 20 ppm a second: an error does not outlive the station's lead, and is not passed from master to master.
#pragma once

#include "station_setup.hpp"

namespace hal::tdma {

class ClockEstimate {
public:
    /// Starts anew. [realtime]
    void clear() noexcept { *this = {}; }
    /// Nobody corrects this clock from here on: it goes on as estimated, or is the global one. [realtime]
    void lead(Time local) noexcept;
    /// While leading, once a cycle: the drift decays to the station's own crystal. [realtime]
    void decay(Time local) noexcept;

    /// A sync, sent at `sent` (global), arrived at `arrived` (local), on its way for `delay`. False: so far off that it was not used.
    /// [realtime]
    bool take(Time sent, Time arrived, Time delay) noexcept;
    /// The delay was measured anew: it is `by` longer than what take() was told so far. [realtime]
    void delay_changed(Time by) noexcept { offset_ += static_cast<double>(by), long_offset_ += static_cast<double>(by); }
    /// Syncs come from another master: its rate is measured anew, and the last one is kept until that is known. [realtime]
    void another_master() noexcept;

    bool   known() const noexcept { return leading_ || taken_ >= 2; }
    bool   settled() const noexcept { return leading_ || taken_ >= 8; }
    Time   global(Time local) const noexcept;
    Time   local(Time global) const noexcept;
    Time   offset(Time local) const noexcept { return global(local) - local; }
    double drift() const noexcept;                    ///< d offset / d local: the long average where there is one
    double uncertainty() const noexcept;              ///< of the long average's slope, one sigma
    double jitter() const noexcept;                   ///< rms of what is not explained, ns

private:
    bool is_certain() const noexcept;
    void take_long(double measured, double dt) noexcept;

    Time          base_ = 0;          // the offset's whole part: kept apart, for a double has 53 bits
    Time          at_ = 0;            // local time of `offset_` and `long_offset_`
    double        offset_ = 0.0, drift_ = 0.0;
    double        square_ = 0.0;      // mean square of e
    double        long_offset_ = 0.0, long_drift_ = 0.0;
    double        held_ = 0.0;        // the last slope that was certain
    double        interval_ = 0.0;    // mean time between syncs, ns
    std::uint32_t taken_ = 0, outliers_ = 0;  // outliers: in a row, all early or all late
    std::uint32_t long_taken_ = 0;
    bool          early_ = false, leading_ = false, holds_ = false;
};

}  // namespace hal::tdma
