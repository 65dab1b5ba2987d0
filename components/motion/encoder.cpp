// SPDX-License-Identifier: MIT
#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>

#include "hal/component.hpp"
#include "hal/queue.hpp"

namespace {

/// What the fast function has seen up to one of its cycles. Positions are in counts since the start.
struct Seen {
    std::int64_t raw = 0;
    std::int64_t now_ns = 0;       // the fast function's own time: the sum of its periods
    std::int64_t tick_ns = 0;      // the newest of them
    std::int64_t edge = 0;         // exact place of the newest edge: between count edge - 1 and count edge
    std::int64_t edge_ns = 0;      // and when it was
    std::uint32_t indexes = 0;     // index marks that counted, so far
    std::uint32_t latches = 0;     // edges of latch-input that counted, so far
    std::int64_t index_raw = 0, latch_raw = 0;
};

struct Encoder : hal::Component {
    using Component::Component;
    static constexpr hal::Traits traits{.default_count = 3};

    hal::Function count{*this, "update-counters", &Encoder::update_counters, "samples the phases and counts; in the fastest thread", {.shared = true}};
    hal::In<bool> phase_a{*this, count, "phase-A", "phase A of the encoder"};
    hal::In<bool> phase_b{*this, count, "phase-B", "phase B of the encoder"};
    hal::In<bool> phase_z{*this, count, "phase-Z", "index pulse of the encoder"};
    hal::Io<bool> x4_mode{*this, count, "x4-mode", "TRUE counts every edge, FALSE one per full cycle", {.initial = true}};
    hal::Io<bool> counter_mode{*this, count, "counter-mode", "TRUE counts rising edges of phase-A and ignores phase-B"};
    hal::In<std::int32_t> missing_teeth{*this, count, "missing-teeth", "counter-mode: teeth missing from the wheel; their gap is the index"};
    hal::In<bool> latch_input{*this, count, "latch-input", "an edge here latches the position"};
    hal::In<bool> latch_rising{*this, count, "latch-rising", "rising edges of latch-input count", {.initial = true}};
    hal::In<bool> latch_falling{*this, count, "latch-falling", "falling edges of latch-input count", {.initial = true}};
    hal::Out<std::int32_t> raw_counts{*this, count, "rawcounts", "counts since the start; knows nothing of reset and index"};
    hal::Out<std::uint32_t> lost{*this, count, "quad-errors", "times both phases changed at once: edges were lost, the thread is too slow"};

    hal::Function capture{*this, "capture-position", &Encoder::capture_position, "scales and publishes; in the servo thread", {.shared = true}};
    hal::Io<bool> index_enable{*this, capture, "index-enable", "TRUE: counts and position become 0 at the next rising edge of phase-Z, and this FALSE"};
    hal::In<bool> reset{*this, capture, "reset", "while TRUE, counts and position are 0"};
    hal::Io<double> position_scale{*this, capture, "position-scale", "counts per position unit", {.initial = 1.0}};
    hal::In<double> min_speed{*this, capture, "min-speed-estimate", "below this, velocity is 0 and position-interpolated is position", {.initial = 1.0}};
    hal::Out<std::int32_t> counts{*this, capture, "counts", "position in counts"};
    hal::Out<std::int32_t> counts_latched{*this, capture, "counts-latched", "counts at the newest edge of latch-input"};
    hal::Out<double> position{*this, capture, "position", "counts / position-scale"};
    hal::Out<double> position_latched{*this, capture, "position-latched", "position at the newest edge of latch-input"};
    hal::Out<double> position_interpolated{*this, capture, "position-interpolated", "position estimated between counts; not for position control"};
    hal::Out<double> velocity{*this, capture, "velocity", "speed in position units per second"};
    hal::Out<double> velocity_rpm{*this, capture, "velocity-rpm", "velocity * 60"};

    void update_counters(hal::Cycle cycle) noexcept {
        seen_.tick_ns = cycle.period_ns();
        seen_.now_ns += seen_.tick_ns;
        const bool a = phase_a, b = phase_b, z = phase_z, latch = latch_input;
        if (!started_) {  // the first sample says where the phases stand; nothing has moved yet
            started_ = true;
            a_ = a, b_ = b, z_ = z, latch_ = latch;
        }
        bool index = z && !z_;
        if (const std::int64_t moved = counter_mode ? teeth(a, index) : edges(a, b); moved != 0) {
            seen_.raw += moved;
            seen_.edge = moved > 0 ? seen_.raw : seen_.raw + 1;
            seen_.edge_ns = seen_.now_ns;
        }
        if (index && armed_.exchange(false, std::memory_order_relaxed)) {
            ++seen_.indexes;
            seen_.index_raw = seen_.raw;
        }
        if ((latch && !latch_ && latch_rising) || (!latch && latch_ && latch_falling)) {
            ++seen_.latches;
            seen_.latch_raw = seen_.raw;
        }
        a_ = a, b_ = b, z_ = z, latch_ = latch;
        raw_counts = static_cast<std::int32_t>(seen_.raw);
        handed_.put(seen_);
    }

    void capture_position(hal::Cycle) noexcept {
        const Seen& now = handed_.get();
        if (std::fabs(position_scale) < 1e-20 || !std::isfinite(position_scale)) position_scale = 1.0;
        const double scale = position_scale;

        if (index_enable && waiting_ && now.indexes != indexes_) {
            zero_ = now.index_raw;
            index_enable = false;
        }
        indexes_ = now.indexes;
        if (index_enable != waiting_) {
            waiting_ = !waiting_;
            armed_.store(waiting_, std::memory_order_relaxed);
        }
        if (reset) zero_ = now.raw;

        if (now.latches != latches_) {
            latches_ = now.latches;
            counts_latched = static_cast<std::int32_t>(now.latch_raw - zero_);
            position_latched = static_cast<double>(now.latch_raw - zero_) / scale;
        }
        counts = static_cast<std::int32_t>(now.raw - zero_);
        position = static_cast<double>(now.raw - zero_) / scale;

        estimate(now);
        const double speed = std::fabs(speed_ / scale) < min_speed ? 0.0 : speed_ / scale;
        velocity = speed;
        velocity_rpm = speed * 60.0;
        position_interpolated = speed == 0.0 ? position.get() : between_edges(now) / scale;
    }

private:
    /// Counts of this cycle in quadrature. One count per cycle of the phases is taken where A changes while B is low,
    /// the same place in both directions.
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

    /// Counts of this cycle on a toothed wheel. A gap as long as the missing teeth counts for them and is the index.
    std::int64_t teeth(bool a, bool& index) noexcept {
        if (!a || a_) return 0;
        const std::int64_t missing = std::max(0, missing_teeth.get());
        const std::int64_t pitch_ns = seen_.now_ns - tooth_ns_;
        const bool gap = missing > 0 && tooth_pitch_ns_ > 0 && 2 * pitch_ns > (missing + 2) * tooth_pitch_ns_;
        tooth_ns_ = seen_.now_ns;
        if (seen_tooth_ && !gap) tooth_pitch_ns_ = pitch_ns;
        seen_tooth_ = true;
        if (missing > 0) index = gap;
        return gap ? missing + 1 : 1;
    }

    /// Speed in counts per second: from one edge to another, each at its exact place, so that a shaft that trembles over
    /// one edge has none; the first edge alone gives none either. While no edge comes, the speed is at most what the next one
    /// would give if it came in the next cycle of the fast function.
    void estimate(const Seen& now) noexcept {
        if (now.edge_ns != edge_ns_) {
            if (edge_ns_ > 0) speed_ = static_cast<double>(now.edge - edge_) * 1e9 / static_cast<double>(now.edge_ns - edge_ns_);
            edge_ = now.edge;
            edge_ns_ = now.edge_ns;
        }
        if (now.now_ns > edge_ns_) {
            const double bound = 1e9 / static_cast<double>(now.now_ns + now.tick_ns - edge_ns_);
            speed_ = std::clamp(speed_, -bound, bound);
        }
    }

    double between_edges(const Seen& now) const noexcept {
        const double travelled = speed_ * 1e-9 * static_cast<double>(now.now_ns - edge_ns_);
        const double place = static_cast<double>(now.edge) + travelled, cell = static_cast<double>(now.raw);
        return std::clamp(place, cell, cell + 1.0) - static_cast<double>(zero_);
    }

    // update-counters only
    Seen seen_;
    bool started_ = false, a_ = false, b_ = false, z_ = false, latch_ = false;
    bool seen_tooth_ = false;
    std::int64_t tooth_ns_ = 0, tooth_pitch_ns_ = 0;  // when the newest tooth came; from tooth to tooth
    // between the two: capture-position sets armed_ while index-enable waits, update-counters clears it at the index
    hal::Mailbox<Seen> handed_;  // update-counters writes, capture-position reads
    std::atomic<bool> armed_{false};
    // capture-position only
    bool waiting_ = false;
    std::uint32_t indexes_ = 0, latches_ = 0;
    std::int64_t zero_ = 0, edge_ = 0, edge_ns_ = 0;
    double speed_ = 0.0;
};

}  // namespace

HAL_COMPONENT(Encoder, "encoder", "Counts quadrature and pulse encoders in software", R"(
`encoder.update-counters` samples the phases of all encoders and belongs into the fastest thread;
`encoder.capture-position` scales the counts and belongs into the servo thread, before the controller. The two may run on
different processors: what passes between them is handed over whole.

A phase must keep each state for at least one period of the fast thread: with 50 us that is 20 000 counts/s. Where both
phases change at once, edges are lost and `quad-errors` counts it.

* **Counting.** With `x4-mode` each edge counts, A before B is forwards. Without it one edge per cycle counts: A while B is
  low. With `counter-mode` each rising edge of A counts up, whatever B does.
* **Index.** Set `index-enable`; at the next rising edge of phase-Z the position becomes 0 and `index-enable` FALSE. With
  `counter-mode` and `missing-teeth` (a wheel with a gap: 58 teeth, 2 missing, scale 60) the end of the gap is the index.
* **Velocity** is the distance between two edges by the time between them. While no edge comes the estimate falls to what
  the next one would give; below `min-speed-estimate` it is 0. An edge that comes back gives 0: it is the same place again.

Counts are kept in 64 bits, so `position` goes on where the 32 bits of `counts` wrap.

**Otherwise than LinuxCNC's**, whose `counts`, `position` and `velocity` are else the same to the last bits: counting starts where
the phases stand in the first cycle (there from both FALSE, so a phase that is TRUE counts). `velocity` begins with the second
edge (there with the third), is 0 after the first edge back (there a count by the time since the last edge, so a shaft that
trembles over one edge seems to turn), and never less than `min-speed-estimate` but 0. `position-interpolated` is `position` at an
edge forwards, and the same at that place backwards (there a count lower, and a fast period further on). `rawcounts` is what
this cycle counted (there what the cycle before did). With `missing-teeth` each of the first teeth counts one (there each counts
as a gap, until the pitch is known, and as the index).

    loadrt encoder names=x
    addf encoder.update-counters base-thread
    addf encoder.capture-position servo-thread
    setp x.position-scale 2000
    net x-A  => x.phase-A
    net x-B  => x.phase-B
    net x-position  <= x.position
)")
