// SPDX-License-Identifier: MIT
// The global clock as a station sees it, estimated from syncs: global = local + offset, where the
// offset grows with the drift.
//
// Two alpha-beta filters of the measured offsets, e = measured - predicted: offset += alpha e,
// drift += beta e / dt. Both begin with gains that weight all measurements equally (a least-squares
// line) and end with fixed ones. The short one (40 syncs) gives the offset and follows a step
// quickly; its slope scatters by sigma / dt / 240. The long one (seconds) gives the drift, which
// calibration, the user and a station that becomes the master need.
//
// Holdover: a station that becomes the master keeps the offset and the drift of the long average if
// that is known to 2 ppm, otherwise the last drift that was; without one it uses its own crystal.
// While it is the master, the drift decays to zero, the rate of its crystal, by at most 20 ppm per
// second, so that an error is not passed from master to master.
#pragma once

#include "station_setup.hpp"

namespace hal::tdma {

class ClockEstimate {
public:
    /// Discards the estimate. [realtime]
    void clear() noexcept { *this = {}; }
    /// Makes this clock the global one: it continues as estimated, without further corrections.
    /// [realtime]
    void lead(Time local) noexcept;
    /// Lets the drift decay to the station's own crystal; called once a cycle while leading.
    /// [realtime]
    void decay(Time local) noexcept;

    /// Uses a sync, sent at `sent` (global ns), arrived at `arrived` (local ns), with a path delay
    /// of `delay` (ns). Returns false for an outlier. [realtime]
    bool accept(Time sent, Time arrived, Time delay) noexcept;
    /// Corrects the offset after a calibration: the delay is `by` ns longer than that given to
    /// accept() so far. [realtime]
    void delay_changed(Time by) noexcept {
        offset_ += static_cast<double>(by);
        long_offset_ += static_cast<double>(by);
    }
    /// Measures the rate of a new master; the last rate is used until that is known. [realtime]
    void another_master() noexcept;

    bool known() const noexcept { return leading_ || accepted_ >= 2; }
    bool settled() const noexcept { return leading_ || accepted_ >= 8; }
    Time global(Time local) const noexcept;
    Time local(Time global) const noexcept;
    Time offset(Time local) const noexcept { return global(local) - local; }
    /// d offset / d local, 1e-6 is 1 ppm: the long average if known
    double drift() const noexcept;
    double uncertainty() const noexcept;  ///< of the long average's slope, one sigma
    double jitter() const noexcept;  ///< rms of the residuals, ns

private:
    bool is_certain() const noexcept;
    void accept_long(double measured, double dt) noexcept;

    Time base_ = 0;  // integer part of the offset, because a double has 53 bits
    Time at_ = 0;  // local time of `offset_` and `long_offset_`
    double offset_ = 0.0;
    double drift_ = 0.0;
    double square_ = 0.0;  // mean square of e
    double long_offset_ = 0.0;
    double long_drift_ = 0.0;
    double held_ = 0.0;  // the last certain drift
    double interval_ = 0.0;  // mean time between syncs, ns
    std::uint32_t accepted_ = 0;
    std::uint32_t outliers_ = 0;  // outliers: consecutive, all early or all late
    std::uint32_t long_accepted_ = 0;
    bool early_ = false;
    bool leading_ = false;
    bool holds_ = false;
};

}  // namespace hal::tdma
