// SPDX-License-Identifier: MIT
// The local clock of an emulated controller: it drifts, jumps and is corrected, on the clock of the
// segment.
#pragma once

#include <cstdint>

namespace hal::ethercat::esc {

/// Counts local time in ns against the time of the segment. [realtime]
class Clock {
public:
    /// Starts at `local_ns` with the present drift and without correction.
    void reset(std::int64_t now_ns, std::int64_t local_ns) noexcept {
        base_now_ = now_ns;
        base_local_ = local_ns;
        fraction_ = correction_ = 0;
    }
    /// Sets the deviation of the oscillator, ppm.
    void set_drift(double ppm, std::int64_t now_ns) noexcept {
        rebase(now_ns);
        drift_ = ppm * 1e-6;
    }
    /// Sets the speed correction of the control loop, relative.
    void set_correction(double rate, std::int64_t now_ns) noexcept {
        rebase(now_ns);
        correction_ = rate;
    }
    /// Adds `ns` to the local time.
    void shift(double ns, std::int64_t now_ns) noexcept;

    std::int64_t at(std::int64_t now_ns) const noexcept;  ///< Returns the local time, ns.
    /// Returns the first segment time at which at() reaches `local_ns`.
    std::int64_t time_of(std::int64_t local_ns) const noexcept;
    double drift_ppm() const noexcept { return drift_ * 1e6; }
    double correction() const noexcept { return correction_; }

private:
    void rebase(std::int64_t now_ns) noexcept;

    std::int64_t base_now_ = 0;
    std::int64_t base_local_ = 0;
    double fraction_ = 0;
    double drift_ = 0;
    double correction_ = 0;
};

}  // namespace hal::ethercat::esc
