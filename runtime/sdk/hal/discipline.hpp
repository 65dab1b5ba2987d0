// SPDX-License-Identifier: MIT
// Disciplines the clock of the threads to an external reference (CANopen SYNC, TDMA sync frames,
// the reference clock of EtherCAT): Discipline computes clock adjustments from measured phase
// errors; DisciplinedClock applies them to all threads of the runtime.
//
//     hal::DisciplinedClock clock_;                       // in the component
//     hal::Discipline       discipline_;
//     void start() { clock_.claim(); }                    // throws when another instance leads
//     void receive(hal::Cycle cycle) noexcept {
//         if (a reference event arrived, at `came_ns`)
//             clock_.step(discipline_.follow(came_ns + lead - cycle.start_ns(), cycle.period_ns(), clock_.limit_ns()));
//     }
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <stdexcept>

#include "hal/component.hpp"

namespace hal {

/// The clock of the threads, for the one instance that disciplines it.
class DisciplinedClock {
public:
    /// Claims the clock in start(), until this instance is stopped. Throws if another instance
    /// leads. [setup]
    void claim() {
        clock_ = hal::extension<hal_clock>("hal.clock/1");
        if (!clock_) {
            throw std::runtime_error("this host does not support external clock adjustment");
        }
        if (!clock_->claim(clock_, detail::creating)) {
            detail::rejected();
        }
    }
    /// Returns true once claim() succeeded. [any]
    bool claimed() const noexcept { return clock_ != nullptr; }
    /// Delays all later deadlines of all threads by `ns` (negative: advances them), limited to
    /// limit_ns() per cycle. [realtime]
    void step(std::int64_t ns) const noexcept {
        if (clock_ && ns != 0) {
            clock_->step(clock_, ns);
        }
    }
    /// Returns the largest adjustment per cycle: a tenth of the period of the fastest thread. [any]
    std::int64_t limit_ns() const noexcept {
        return clock_ ? __atomic_load_n(&clock_->limit_ns, __ATOMIC_RELAXED) : 0;
    }
    /// Returns the sum of all adjustments. [any]
    std::int64_t shift_ns() const noexcept {
        return clock_ ? __atomic_load_n(&clock_->shift_ns, __ATOMIC_RELAXED) : 0;
    }

private:
    const hal_clock* clock_ = nullptr;
};

struct DisciplineOptions {
    /// number of events per estimate, 2 or more: more reduce noise, fewer track a changing rate
    /// sooner
    double memory = 40;
    /// largest rate deviation of the reference; quartz is within 100e-6
    double max_rate = 1e-3;
    /// mean phase error below which the clock is locked; 0: period / 20
    std::int64_t lock_ns = 0;
};

/// Tracks an external reference by its measured phase errors.
///
/// A phase error is the arrival time of an event minus its expected time by this clock, all
/// adjustments included; the caller folds it into half a period. With p the predicted phase error,
/// r the drift of the reference per period, a and b gains, and m the limited residual:
///
///     m = clip(error - p, 4 s)        p += a m        r += b m        step = clip(p + r, limit)        p += r - step
///
/// Unless the limit applies, p is 0 afterwards and this is a PI controller: step = (a + b) error +
/// sum of b error. As p includes the steps, a limited one neither winds up the integral nor
/// disturbs the estimate: the same formula acquires and tracks. The gains are those of the
/// growing-memory filter, a straight line fitted to all n events so far, until n reaches `memory`:
/// a = 2(2n-1)/(n(n+1)), b = 6/(n(n+1)); so the first event sets the phase, the second the rate,
/// and noise falls with every further one. s is the mean size of the residuals: the residual of a
/// delayed event is limited to four times that; four such events in a row on one side are a phase
/// jump of the reference, which is adopted at once while the rate is kept. There is no dead band.
///
/// When adjustments of two periods in total have not reduced the error, none is made for some
/// events. An error that stays the same then is that of a feedback loop; one that moves faster than
/// `max_rate` is that of a reference with another period, which is followed again once its rate is
/// within the limit.
/// Source: Brookner, Tracking and Kalman Filtering Made Easy, 1.2.6 (growing memory), 1.2.10
/// (limits on noise); the clipping is Huber's.
class Discipline {
public:
    explicit Discipline(DisciplineOptions options = {}) noexcept : options_(options) {}

    /// Takes the phase error `error_ns` of an event and returns the adjustment to apply now, at
    /// most `limit_ns` (0: a tenth of the period). `period_ns` is the interval of the reference.
    /// [realtime]
    std::int64_t follow(std::int64_t error_ns, std::int64_t period_ns,
                        std::int64_t limit_ns = 0) noexcept {
        const auto error = static_cast<double>(error_ns);
        const auto period = static_cast<double>(period_ns);
        if (state_ != State::following) {
            observe(error_ns, period, limit_ns);
            return 0;
        }
        double residual = error - phase_;
        if (events_ == 0) {
            phase_ = error;
            events_ = rate_known_ ? options_.memory / 2 : 1;
            if (!rate_known_) {
                scatter_ = period * 1e-2;  // unknown yet, too: assume a large value
            }
        } else {
            const double gate = std::max(4 * scatter_, period * 1e-3);
            const bool beyond = std::abs(residual) > gate;
            if (!beyond) {
                beyond_ = 0;
            } else if (residual > 0) {
                beyond_ = std::max(beyond_, 0) + 1;
            } else {
                beyond_ = std::min(beyond_, 0) - 1;
            }
            scatter_ += (std::min(std::abs(residual), 2 * gate) - scatter_) / 16;
            if (std::abs(beyond_) >= 4) {
                phase_ = error;
                beyond_ = 0;
                events_ = std::min(events_, options_.memory / 2);
            } else {
                residual = std::clamp(residual, -gate, gate);
                events_ = std::min(events_ + 1, std::max(options_.memory, 2.0));
                const double by = events_ * (events_ + 1);
                phase_ += residual * 2 * (2 * events_ - 1) / by;
                drift_ += residual * 6 / by;
            }
        }
        error_ns_ = error_ns;
        judge(std::abs(error), period);
        const std::int64_t step = advance(period, limit_ns);
        // noise of the rate does not add up
        pulled_ = locked_ ? 0 : pulled_ * (1 - 1.0 / 256) + static_cast<double>(step) - drift_;
        if (std::abs(pulled_) > 2 * period) {
            // the last step moves the error of the next event, which begins the observation
            state_ = State::stopped;
        }
        return step;
    }

    /// Continues at the estimated rate after a missing event. Returns the adjustment to apply now.
    /// [realtime]
    std::int64_t coast(std::int64_t period_ns, std::int64_t limit_ns = 0) noexcept {
        if (events_ < 2 || state_ != State::following) return 0;
        return advance(static_cast<double>(period_ns), limit_ns);
    }

    /// Unlocks after loss of the reference. The next event starts a new acquisition from the last
    /// known rate. [realtime]
    void lose() noexcept {
        rate_known_ = rate_known_ || events_ >= options_.memory / 2;
        phase_ = 0;
        events_ = 0;
        beyond_ = 0;
        judged_ = 0;
        pulled_ = 0;
        state_ = State::following;
        locked_ = false;
    }

    /// True after 16 consecutive events whose mean error is within `lock_ns`; false again at twice
    /// that error. [any]
    bool locked() const noexcept { return locked_; }
    /// True for a feedback loop: adjustments of two periods in total have not reduced the error,
    /// since this clock itself drives the reference. No more adjustments are made until lose(), or
    /// until the reference moves by itself. [any]
    bool in_vain() const noexcept { return state_ == State::in_vain; }
    /// measured error of the last event
    std::int64_t error_ns() const noexcept { return error_ns_; }
    double scatter_ns() const noexcept { return scatter_; }  ///< mean residual
    /// 200e-6: a second of the reference is 200 us longer than one of this clock
    double rate() const noexcept { return rate_; }

private:
    enum class State : std::uint8_t {
        following,
        // without adjustments:
        stopped,  ///< they had no effect
        observing,  ///< whether the error moves by itself
        in_vain,  ///< it does not: a feedback loop
        too_fast,  ///< faster than `max_rate`, in either direction
    };

    /// Decides every `observed_max` events what the reference does without adjustments.
    void observe(std::int64_t error_ns, double period, std::int64_t limit_ns) noexcept {
        const auto moved = static_cast<double>(error_ns - error_ns_);
        error_ns_ = error_ns;
        if (state_ == State::stopped) {
            state_ = State::observing;
            return begin_observation();
        }
        // The caller folds errors into a period of its thread, which is at least 10 limits: more
        // than a quarter of that is a fold, or too fast anyway.
        const double max_move = limit_ns > 0 ? 2.5 * static_cast<double>(limit_ns) : period / 4;
        ++observed_;
        if (std::abs(moved) < max_move) {
            moved_ += moved;
            ++moves_;
        }
        if (observed_ < observed_max) return;
        decide(period);
        begin_observation();
    }
    void begin_observation() noexcept {
        moved_ = 0;
        observed_ = 0;
        moves_ = 0;
    }
    void decide(double period) noexcept {
        const bool is_measured = 2 * moves_ > observed_;
        const double drift = is_measured ? moved_ / moves_ : 0;
        if (!is_measured || std::abs(drift) > options_.max_rate * period) {
            state_ = State::too_fast;
        } else if (state_ == State::observing) {
            state_ = State::in_vain;
        } else if (state_ == State::too_fast) {
            lose();
            drift_ = drift;
            rate_known_ = true;
        }
        rate_ = is_measured ? drift / period : 0;
    }
    std::int64_t advance(double period, std::int64_t limit_ns) noexcept {
        drift_ = std::clamp(drift_, -options_.max_rate * period, options_.max_rate * period);
        rate_ = drift_ / period;
        const double limit = limit_ns > 0 ? static_cast<double>(limit_ns) : period / 10;
        const double step = std::round(std::clamp(phase_ + drift_, -limit, limit));
        phase_ += drift_ - step;
        return static_cast<std::int64_t>(step);
    }
    void judge(double distance, double period) noexcept {
        const double lock =
            options_.lock_ns > 0 ? static_cast<double>(options_.lock_ns) : period / 20;
        distance_ = judged_ == 0 ? distance : distance_ + (distance - distance_) / 16;
        judged_ = std::min(judged_ + 1, 16);
        locked_ = distance_ < (locked_ ? 2 * lock : lock) && (locked_ || judged_ == 16);
    }

    DisciplineOptions options_;
    double phase_ = 0;
    double drift_ = 0;  // p and r of the formula, ns and ns per period
    double scatter_ = 0;
    double distance_ = 0;
    double rate_ = 0;
    double events_ = 0;  // n
    double pulled_ = 0;  // adjustments beyond the drift since the last lock
    bool rate_known_ = false;  // kept from before the loss of the reference
    static constexpr int observed_max = 32;
    State state_ = State::following;
    double moved_ = 0;  // sum of the moves of the error, while there are no adjustments
    int observed_ = 0;  // events since the last decision
    int moves_ = 0;  // of them, those in moved_
    int beyond_ = 0;  // consecutive residuals beyond the gate, with their sign
    int judged_ = 0;
    std::int64_t error_ns_ = 0;
    bool locked_ = false;
};

}  // namespace hal
