// SPDX-License-Identifier: MIT
// A clock that follows an outside beat (a CANopen SYNC, a TDMA sync frame, EtherCAT's reference clock): Discipline makes of measured
// phase errors the steps that bring the clock to the beat and keep it there; DisciplinedClock makes those steps with all threads of
// the runtime.
//
//     hal::DisciplinedClock clock_;                       // in the component
//     hal::Discipline       beat_;
//     void start() { clock_.claim(); }                    // throws when another instance leads
//     void receive(hal::Cycle cycle) noexcept {
//         if (a beat came, at `came_ns`)
//             clock_.step(beat_.follow(came_ns + lead - cycle.start_ns(), cycle.period_ns(), clock_.limit_ns()));
//     }
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <stdexcept>

#include "hal/component.hpp"

namespace hal {

/// The threads' clock in the hands of the one instance that disciplines it.
class DisciplinedClock {
public:
    /// In start(): the threads follow this instance until it is stopped. Throws when they follow another. [setup]
    void claim() {
        clock_ = hal::extension<hal_clock>("hal.clock/1");
        if (!clock_) throw std::runtime_error("the threads here cannot follow an outside beat");
        if (!clock_->claim(clock_, detail::creating)) detail::refused();
    }
    /// What is due after this cycle comes so much later, in all threads; beyond limit_ns() per cycle it is cut off. [realtime]
    void step(std::int64_t ns) const noexcept {
        if (clock_ && ns != 0) clock_->step(clock_, ns);
    }
    /// Most that the steps of one cycle do: a tenth of the fastest thread's period. [any]
    std::int64_t limit_ns() const noexcept { return clock_ ? __atomic_load_n(&clock_->limit_ns, __ATOMIC_RELAXED) : 0; }
    /// Sum of all steps. [any]
    std::int64_t shift_ns() const noexcept { return clock_ ? __atomic_load_n(&clock_->shift_ns, __ATOMIC_RELAXED) : 0; }

private:
    const hal_clock* clock_ = nullptr;
};

struct DisciplineOptions {
    double memory = 40;          ///< beats that an estimate is made of, 2 or more: more are calmer, fewer follow a changing rate sooner
    double max_rate = 1e-3;      ///< the beat's clock is at most so fast or slow: quartz is within 100e-6
    std::int64_t lock_ns = 0;    ///< locked while the beats are on average so near to where they are expected; 0: period / 20
};

/// Follows a beat by its measured phase errors.
///
/// A phase error is when the beat came less when it should have come by this clock, which all steps so far have moved; the caller brings
/// it within half a period. With p the phase error expected, r the beat's drift per period, a and b gains, and m the residual limited:
///
///     m = clip(error - p, 4 s)        p += a m        r += b m        step = clip(p + r, limit)        p += r - step
///
/// Unless the limit cuts, p is 0 afterwards and this is a PI controller: step = (a + b) error + sum of b error. As p knows of the steps,
/// a limited one neither winds up the integral nor disturbs the estimate: the same formula acquires and holds. The gains are those of
/// the growing-memory filter, a straight line fitted to all n beats so far, until n reaches `memory`: a = 2(2n-1)/(n(n+1)),
/// b = 6/(n(n+1)); so the first beat sets the phase, the second the rate, and noise falls with every further one. s is the mean size of
/// the residuals: a beat that was held up counts as four times that and no more; four such in a row on one side are the beat's new
/// place, which is taken over at once with the rate kept. There is no dead band.
/// Source: Brookner, Tracking and Kalman Filtering Made Easy, 1.2.6 (growing memory), 1.2.10 (limits on noise); the clipping is Huber's.
class Discipline {
public:
    explicit Discipline(DisciplineOptions options = {}) noexcept : options_(options) {}

    /// A beat was measured, `error_ns` late by this clock. Returns the step to make now. `period_ns` is the time between two beats; a
    /// step has at most `limit_ns`, 0: a tenth of the period. [realtime]
    std::int64_t follow(std::int64_t error_ns, std::int64_t period_ns, std::int64_t limit_ns = 0) noexcept {
        const auto error = static_cast<double>(error_ns), period = static_cast<double>(period_ns);
        double residual = error - phase_;
        if (beats_ == 0) {
            phase_ = error;
            beats_ = rate_known_ ? options_.memory / 2 : 1;
            if (!rate_known_) scatter_ = period * 1e-2;  // not known yet either: rather too large
        } else {
            const double gate = std::max(4 * scatter_, period * 1e-3);
            const bool beyond = std::abs(residual) > gate;
            beyond_ = !beyond ? 0 : residual > 0 ? std::max(beyond_, 0) + 1 : std::min(beyond_, 0) - 1;
            scatter_ += (std::min(std::abs(residual), 2 * gate) - scatter_) / 16;
            if (std::abs(beyond_) >= 4) {
                phase_ = error;
                beyond_ = 0;
                beats_ = std::min(beats_, options_.memory / 2);
            } else {
                residual = std::clamp(residual, -gate, gate);
                beats_ = std::min(beats_ + 1, std::max(options_.memory, 2.0));
                const double by = beats_ * (beats_ + 1);
                phase_ += residual * 2 * (2 * beats_ - 1) / by;
                drift_ += residual * 6 / by;
            }
        }
        error_ns_ = error_ns;
        judge(std::abs(error), period);
        if (in_vain_) return 0;
        const std::int64_t step = advance(period, limit_ns);
        pulled_ = locked_ ? 0 : pulled_ * (1 - 1.0 / 256) + static_cast<double>(step) - drift_;  // noise of the rate does not add up
        in_vain_ = std::abs(pulled_) > 2 * period;
        return step;
    }

    /// A beat was due and did not come: goes on at the rate that was found. Returns the step to make now. [realtime]
    std::int64_t coast(std::int64_t period_ns, std::int64_t limit_ns = 0) noexcept {
        return beats_ < 2 || in_vain_ ? 0 : advance(static_cast<double>(period_ns), limit_ns);
    }

    /// The beat is gone: no longer locked. The next one is acquired anew, with the rate known so far as a start. [realtime]
    void lose() noexcept {
        rate_known_ = rate_known_ || beats_ >= options_.memory / 2;
        phase_ = 0;
        beats_ = 0;
        beyond_ = 0;
        judged_ = 0;
        pulled_ = 0;
        locked_ = in_vain_ = false;
    }

    /// The beats have for 16 in a row been on average within `lock_ns` of this clock; ends when they are twice as far off. [any]
    bool locked() const noexcept { return locked_; }
    /// Steps of two periods in all have brought the beat no nearer: it moves with this clock, because it is made by it. No more steps are
    /// made until lose(). [any]
    bool in_vain() const noexcept { return in_vain_; }
    std::int64_t error_ns() const noexcept { return error_ns_; }  ///< of the last beat, as it was measured
    double scatter_ns() const noexcept { return scatter_; }       ///< mean distance of a beat from where it was expected
    double rate() const noexcept { return rate_; }                ///< 200e-6: the beat's second is 200 us longer than this clock's

private:
    std::int64_t advance(double period, std::int64_t limit_ns) noexcept {
        drift_ = std::clamp(drift_, -options_.max_rate * period, options_.max_rate * period);
        rate_ = drift_ / period;
        const double limit = limit_ns > 0 ? static_cast<double>(limit_ns) : period / 10;
        const double step = std::round(std::clamp(phase_ + drift_, -limit, limit));
        phase_ += drift_ - step;
        return static_cast<std::int64_t>(step);
    }
    void judge(double distance, double period) noexcept {
        const double lock = options_.lock_ns > 0 ? static_cast<double>(options_.lock_ns) : period / 20;
        distance_ = judged_ == 0 ? distance : distance_ + (distance - distance_) / 16;
        judged_ = std::min(judged_ + 1, 16);
        locked_ = distance_ < (locked_ ? 2 * lock : lock) && (locked_ || judged_ == 16);
    }

    DisciplineOptions options_;
    double phase_ = 0, drift_ = 0;        // p and r of the formula, ns and ns per period
    double scatter_ = 0, distance_ = 0, rate_ = 0;
    double beats_ = 0;                    // n
    double pulled_ = 0;                   // by steps beyond the drift, since it was last locked
    bool rate_known_ = false;             // from before the beat was lost
    int beyond_ = 0;                      // residuals beyond the gate in a row, with their sign
    int judged_ = 0;
    std::int64_t error_ns_ = 0;
    bool locked_ = false, in_vain_ = false;
};

}  // namespace hal
