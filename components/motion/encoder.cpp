// SPDX-License-Identifier: MIT
#include "edge_count.hpp"
#include "hal/corrected.hpp"
#include "hal/retained.hpp"

namespace {

struct Encoder : hal::Component {
    using Component::Component;
    static constexpr hal::Traits traits{.default_count = 3};

    hal::Function count{*this,
                        "update-counters",
                        &Encoder::update_counters,
                        "samples the phases and counts; belongs in the fastest thread",
                        {.shared = true}};
    hal::In<bool> phase_a{*this, count, "phase-A", "encoder phase A"};
    hal::In<bool> phase_b{*this, count, "phase-B", "encoder phase B"};
    hal::In<bool> phase_z{*this, count, "phase-Z", "encoder index pulse"};
    hal::Io<bool> x4_mode{*this,
                          count,
                          "x4-mode",
                          "TRUE counts every edge, FALSE one per full cycle",
                          {.initial = true}};
    hal::Io<bool> counter_mode{*this, count, "counter-mode",
                               "TRUE counts rising edges of phase-A and ignores phase-B"};
    hal::In<std::int32_t> missing_teeth{
        *this, count, "missing-teeth",
        "counter-mode: teeth missing from the wheel; the gap is the index"};
    hal::In<bool> latch_input{*this, count, "latch-input",
                              "an edge of this input latches the position"};
    hal::In<bool> latch_rising{
        *this, count, "latch-rising", "TRUE: rising edges of latch-input latch", {.initial = true}};
    hal::In<bool> latch_falling{*this,
                                count,
                                "latch-falling",
                                "TRUE: falling edges of latch-input latch",
                                {.initial = true}};
    hal::Out<std::int32_t> raw_counts{*this, count, "rawcounts",
                                      "counts since the start, unaffected by reset and index"};
    hal::Out<std::uint32_t> lost{
        *this, count, "quad-errors",
        "times both phases changed at once: edges were lost because the thread is too slow"};

    hal::Function capture{*this,
                          "capture-position",
                          &Encoder::capture_position,
                          "scales the counts; belongs in the servo thread",
                          {.shared = true}};
    hal::Io<bool> index_enable{*this, capture, "index-enable",
                               "TRUE: the next rising edge of phase-Z sets counts and position to "
                               "0 and this pin to FALSE"};
    hal::In<bool> reset{*this, capture, "reset", "TRUE holds counts and position at 0"};
    hal::Io<double> position_scale{
        *this, capture, "position-scale", "counts per position unit", {.initial = 1.0}};
    hal::CorrectedIn<double> min_speed{
        *this,
        capture,
        "min-speed-estimate",
        "below this speed velocity is 0 and position-interpolated equals position",
        {.initial = 1.0}};
    hal::Out<std::int32_t> counts{*this, capture, "counts", "position in counts"};
    hal::Out<std::int32_t> counts_latched{*this, capture, "counts-latched",
                                          "counts at the newest edge of latch-input"};
    hal::Out<double> position{*this, capture, "position", "counts / position-scale"};
    hal::Out<double> position_latched{*this, capture, "position-latched",
                                      "position at the newest edge of latch-input"};
    hal::Out<double> position_interpolated{
        *this, capture, "position-interpolated",
        "position interpolated between counts; not for position control"};
    hal::Out<double> velocity{*this, capture, "velocity", "speed in position units per second"};
    hal::Out<double> velocity_rpm{*this, capture, "velocity-rpm", "velocity * 60"};

    void update_counters(hal::Cycle cycle) noexcept {
        count_.begin(cycle.period_ns());
        const bool a = phase_a;
        const bool b = phase_b;
        const bool z = phase_z;
        const bool latch = latch_input;
        // the first sample is the initial state of the phases; nothing has moved yet
        if (!started_) {
            started_ = true;
            a_ = a;
            b_ = b;
            z_ = z;
            latch_ = latch;
        }
        now_ns_ += cycle.period_ns();
        bool index = z && !z_;
        count_.move(counter_mode ? teeth(a, index) : edges(a, b));
        if (index) {
            count_.index();
        }
        if ((latch && !latch_ && latch_rising) || (!latch && latch_ && latch_falling)) {
            count_.latch();
        }
        a_ = a;
        b_ = b;
        z_ = z;
        latch_ = latch;
        raw_counts = static_cast<std::int32_t>(count_.publish().raw);
    }

    void capture_position(hal::Cycle) noexcept {
        const auto& now = count_.capture(index_enable, reset);
        const std::int64_t zero = count_.zero();
        const double scale = scale_.get();
        if (min_speed == 0.0) {
            min_speed.correct(1.0);
        }

        if (now.latches != latches_) {
            latches_ = now.latches;
            counts_latched = static_cast<std::int32_t>(now.latch_raw - zero);
            position_latched = static_cast<double>(now.latch_raw - zero) / scale;
        }
        counts = static_cast<std::int32_t>(now.raw - zero);
        position = static_cast<double>(now.raw - zero) / scale;

        const double estimated = count_.speed(now) / scale;

        const double speed = std::fabs(estimated) < min_speed ? 0.0 : estimated;
        velocity = speed;
        velocity_rpm = speed * 60.0;
        position_interpolated = speed == 0.0 ? position.get() : count_.interpolate(now) / scale;
    }

private:
    /// Returns the counts of this cycle in quadrature. Without x4-mode the one count per cycle is
    /// where A changes while B is low: at the same position in both directions.
    std::int64_t edges(bool a, bool b) noexcept {
        if (a == a_ && b == b_) return 0;
        if (a != a_ && b != b_) {
            lost = lost + 1;
            return 0;
        }
        const bool forward = a != a_ ? a != b : a == b;
        if (!x4_mode && (a == a_ || b)) return 0;
        return forward ? 1 : -1;
    }

    /// Returns the counts of this cycle on a toothed wheel. A gap as wide as the missing teeth
    /// counts for them and is the index.
    std::int64_t teeth(bool a, bool& index) noexcept {
        if (!a || a_) return 0;
        const std::int64_t missing = std::max(0, missing_teeth.get());
        const std::int64_t pitch_ns = now_ns_ - tooth_ns_;
        const bool gap =
            missing > 0 && tooth_pitch_ns_ > 0 && 2 * pitch_ns > (missing + 2) * tooth_pitch_ns_;
        tooth_ns_ = now_ns_;
        if (seen_tooth_ && !gap) {
            tooth_pitch_ns_ = pitch_ns;
        }
        seen_tooth_ = true;
        if (missing > 0) {
            index = gap;
        }
        return gap ? missing + 1 : 1;
    }

    edge_count::Count count_;
    edge_count::Scale scale_{*this, position_scale};
    // update-counters
    bool started_ = false;
    bool a_ = false;
    bool b_ = false;
    bool z_ = false;
    bool latch_ = false;
    bool seen_tooth_ = false;
    // time of the newest tooth; time from tooth to tooth
    std::int64_t now_ns_ = 0;
    std::int64_t tooth_ns_ = 0;
    std::int64_t tooth_pitch_ns_ = 0;
    // capture-position
    std::uint32_t latches_ = 0;
    hal::Retained retained_{*this,
                            {{"count", count_},
                             {"started", started_},
                             {"a", a_},
                             {"b", b_},
                             {"z", z_},
                             {"latch", latch_},
                             {"seen-tooth", seen_tooth_},
                             {"now-ns", now_ns_},
                             {"tooth-ns", tooth_ns_},
                             {"tooth-pitch-ns", tooth_pitch_ns_},
                             {"latches", latches_}}};
};

}  // namespace

HAL_COMPONENT(Encoder, "encoder", "Counts quadrature and pulse encoders in software", R"(
`encoder.update-counters` samples the phases of all encoders and belongs in the fastest thread;
`encoder.capture-position` scales the counts and belongs in the servo thread, before the controller.
The two may run on different CPUs.

A phase must keep each state for at least one period of the fast thread: with 50 us that is 20 000
counts/s. If both phases change at once, edges are lost and `quad-errors` increases.

* **Counting.** With `x4-mode` each edge counts; A leads B in the forward direction. Without it one
  edge per cycle counts: A while B is low. With `counter-mode` each rising edge of A counts up,
  whatever the state of B.
* **Index.** Set `index-enable`; the next rising edge of phase-Z sets the position to 0 and
  `index-enable` to FALSE. With `counter-mode` and `missing-teeth` (a wheel with a gap: 58 teeth, 2
  missing, scale 60) the end of the gap is the index.
* **Velocity** is the distance between two edges divided by the time between them. While no edge
  arrives, the estimate falls to what the next one would give; below `min-speed-estimate` it is 0.
  An edge crossed back gives 0: the position is the same.

Counts are kept in 64 bits, so `position` is continuous when the 32 bits of `counts` wrap. While
`position-scale` is NaN or infinite, its last valid value applies, and a fault names it; 0 is set to
1, as in LinuxCNC. A negative scale is the other direction: the counts stay, and `position` turns
around with the sign.

**Differences from LinuxCNC:** `counts`, `position` and `velocity` are bit-identical except in these
cases. Counting starts from the state of the phases in the first cycle (LinuxCNC starts from both
FALSE, so a phase that is TRUE counts). `velocity` starts with the second edge (LinuxCNC: the
third), is 0 after the first edge in the opposite direction (LinuxCNC: one count per time since the
last edge, so a shaft that trembles across one edge appears to turn), and is 0 whenever it is below
`min-speed-estimate`. `position-interpolated` equals `position` at an edge crossed forwards, and has
the same value at that edge crossed backwards (LinuxCNC: one count less, one fast period later).
`rawcounts` includes this cycle's count (LinuxCNC: the previous cycle's). With `missing-teeth` each
of the first teeth counts one (LinuxCNC counts each as a gap, and as the index, until the pitch is
known).

    loadrt encoder names=x
    addf encoder.update-counters base-thread
    addf encoder.capture-position servo-thread
    setp x.position-scale 2000
    net x-A  => x.phase-A
    net x-B  => x.phase-B
    net x-position  <= x.position
)")
