// SPDX-License-Identifier: MIT
#include <cstdint>
#include <string>

#include "hal/component.hpp"
#include "hal/edge.hpp"
#include "hal/interruption.hpp"
#include "hal/retained.hpp"

namespace {

enum class Encoding : std::uint8_t { gray, binary, bcd, single, index, edge, counts };

Encoding encoding_of(const std::string& name) {
    constexpr const char* names[] = {"gray", "binary", "bcd", "single", "index", "edge", "counts"};
    for (std::size_t i = 0; i < std::size(names); ++i) {
        if (name == names[i]) return static_cast<Encoding>(i);
    }
    throw hal::ArgumentError(
        "encoding",
        "invalid encoding '" + name + "'; write gray, binary, bcd, single, index, edge or counts");
}

struct Carousel : hal::Component {
    using Component::Component;
    static constexpr hal::ArgumentOptions list(std::int64_t min, std::int64_t max) {
        return {.per_instance = true, .min = min, .max = max};
    }
    hal::Argument pockets{*this, "pockets", 8, "number of pockets", list(1, 1000)};
    hal::TextArgument encoding_name{*this,
                                    "encoding",
                                    "gray",
                                    "gray, binary, bcd, single, index, edge or counts",
                                    {.per_instance = true}};
    hal::Argument num_sense{*this, "num_sense", 4, "number of position sensors; index has 2",
                            list(1, 1000)};
    hal::Argument directions{*this, "dir", 2, "2: both directions, 1: forward only", list(1, 2)};
    hal::Argument parity_wanted{*this, "parity", 0, "1: odd, 0: even parity", list(0, 1)};
    const Encoding encoding = encoding_of(encoding_name.get());

    hal::In<std::int32_t> pocket_number{
        *this, "pocket-number", "target pocket; wraps around above the last one; 0: no move"};
    hal::In<bool> enable{*this, "enable",
                         "a rising edge starts the move to the target pocket; FALSE stops it"};
    hal::Out<bool> active{*this, "active", "TRUE while moving, homing, aligning or locking"};
    hal::Out<bool> ready{*this, "ready", "TRUE at the target pocket, until the next move"};
    hal::In<bool> strobe{*this, "strobe", "FALSE ignores the position sensors", {.initial = true}};
    hal::In<bool> parity{*this, "parity", "parity bit of the position encoder"};
    hal::Ins<bool> sense{*this, "sense-#", sensors(), "position sensor #"};
    hal::In<double> rev_pulse{*this,
                              "rev-pulse",
                              "duration of the reverse run that locks the carousel at the pocket",
                              {.unit = "s"}};
    hal::In<double> fwd_dc{*this, "fwd-dc", "motor-vel while turning forward"};
    hal::In<double> rev_dc{*this, "rev-dc", "motor-vel while turning in reverse"};
    hal::In<double> hold_dc{*this, "hold-dc", "motor-vel at standstill"};
    hal::In<double> align_dc{*this, "align-dc",
                             "speed of the final slow alignment to the marker; 0: no alignment"};
    hal::In<double> decel_time{*this, "decel-time", "pause before the alignment", {.unit = "s"}};
    hal::In<std::int32_t> counts{*this, "counts",
                                 "counts: rawcounts of the encoder or step generator"};
    hal::In<std::int32_t> scale{
        *this, "scale", "counts: counts from pocket to pocket", {.initial = 100}};
    hal::In<std::int32_t> width{
        *this, "width", "counts: distance from its centre within which a pocket is reached"};
    hal::In<std::int32_t> home_offset{*this, "home-offset",
                                      "counts: counts from the index to pocket 1"};
    hal::Io<bool> index_enable{*this, "index-enable",
                               "counts: TRUE while waiting for the encoder's index"};
    hal::In<bool> jog_fwd{*this, "jog-fwd", "a rising edge moves one pocket forward"};
    hal::In<bool> jog_rev{*this, "jog-rev", "a rising edge moves one pocket back (with dir=2)"};
    hal::Out<bool> motor_fwd{*this,
                             "motor-fwd",
                             "TRUE drives the motor forward, to higher pocket numbers",
                             {.safe = false}};
    hal::Out<bool> motor_rev{*this,
                             "motor-rev",
                             "TRUE drives the motor in reverse, to lower pocket numbers",
                             {.safe = false}};
    hal::Out<bool> parity_error{*this, "parity-error",
                                "TRUE: the sensors do not match the parity bit"};
    hal::Out<std::int32_t> current_position{*this, "current-position",
                                            "current pocket; 0: unknown"};
    hal::Out<double> motor_vel{*this,
                               "motor-vel",
                               "speed command for the motor: fwd-dc, rev-dc, align-dc or hold-dc",
                               {.safe = 0.0}};
    hal::Out<bool> homed{*this, "homed", "TRUE: the position of pocket 1 is known"};
    hal::In<bool> unhome{*this, "unhome", "TRUE clears homed"};
    hal::Out<std::int32_t> state{
        *this, "state",
        "0 idle, 1 homing, 2 moving, 3 decelerating, 4 5 6 aligning, 7 locking, 8 jogging"};
    hal::Out<bool> homing{*this, "homing", "TRUE while homing to pocket 1"};
    hal::Out<double> timer{
        *this, "timer", "remaining time of decel-time or rev-pulse", {.unit = "s"}};
    hal::Out<std::int32_t> motor_dir{*this, "motor-dir", "1 forward, -1 reverse, 0 stopped"};
    hal::Param<std::uint32_t> debounce{
        *this, "debounce",
        "cycles for which a reading of gray, binary, bcd or single must be stable"};
    hal::Function run{*this, "", &Carousel::update, "reads the sensors and controls the motor"};

    void update(hal::Cycle cycle) noexcept {
        if (unhome) {
            homed = false;
        }
        if (interruption_.accept() && state_ != State::rests) {
            abandon();
        }
        look();
        const bool stops = state_ != State::homing && state_ != State::jogging;
        if (!enable && stops) {
            enter(State::rests);
        }
        const bool called = enable_edge_.rises(enable);
        const bool forward = forward_edge_.rises(jog_fwd);
        const bool back = reverse_edge_.rises(jog_rev) && directions == 2;
        if (called && (state_ == State::rests || state_ == State::jogging)) {
            begin();
        } else if (state_ == State::rests && !enable && forward != back) {
            direction_ = forward ? 1 : -1;
            from_ = position_;
            enter(State::jogging);
        }
        step(cycle.seconds());
        publish();
    }

private:
    enum class State : std::uint8_t {
        rests,
        homing,
        moves,
        slows,
        seeks,
        leaves,
        returns,
        locks,
        jogging
    };

    std::int64_t sensors() const noexcept {
        switch (encoding) {
        case Encoding::single: return std::max<std::int64_t>(num_sense, pockets);
        case Encoding::index: return 2;
        case Encoding::edge: return std::max<std::int64_t>(num_sense, 2);
        default: return num_sense;
        }
    }
    bool absolute() const noexcept { return encoding < Encoding::index; }
    bool knows_position() const noexcept { return absolute() || homed; }
    /// Returns `pocket` wrapped to 1..pockets.
    std::int64_t wrapped(std::int64_t pocket) const noexcept {
        return ((pocket - 1) % pockets + pockets) % pockets + 1;
    }
    void enter(State next) noexcept { state_ = next; }

    // ---- where it is

    void look() noexcept {
        marker_ = false;
        if (absolute()) {
            look_at_code();
        } else if (encoding == Encoding::counts) {
            look_at_counts();
        } else {
            look_at_pulses();
        }
        const bool coded = absolute() && encoding != Encoding::single;
        if (!coded) {
            parity_error = false;
        } else if (strobe) {
            parity_error = has_odd_parity() != (parity_wanted != 0);
        }
    }

    /// Returns whether the number of TRUE bits of the code and its parity bit is odd.
    bool has_odd_parity() const noexcept {
        bool odd = parity;
        for (const auto& bit : sense) {
            odd = odd != bit.get();
        }
        return odd;
    }

    /// Returns the number of the pocket that the sensors show; 0: none.
    std::int64_t code() const noexcept {
        switch (encoding) {
        case Encoding::single: return first_sensor();
        case Encoding::gray: return from_gray(bits());
        case Encoding::bcd: return from_bcd(bits());
        default: return bits();
        }
    }
    std::int64_t first_sensor() const noexcept {
        for (std::size_t i = 0; i < sense.size(); ++i) {
            if (sense[i]) return static_cast<std::int64_t>(i) + 1;
        }
        return 0;
    }
    std::uint32_t bits() const noexcept {
        std::uint32_t bits = 0;
        for (std::size_t i = 0; i < std::min<std::size_t>(sense.size(), 32); ++i) {
            bits |= std::uint32_t{sense[i]} << i;
        }
        return bits;
    }
    static std::uint32_t from_gray(std::uint32_t bits) noexcept {
        for (unsigned shift = 1; shift < 32; shift *= 2) {
            bits ^= bits >> shift;
        }
        return bits;
    }
    static std::int64_t from_bcd(std::uint32_t bits) noexcept {
        std::int64_t value = 0;
        for (int shift = 28; shift >= 0; shift -= 4) {
            value = value * 10 + (bits >> shift & 15u);
        }
        return value;
    }

    void look_at_code() noexcept {
        if (!strobe) return;
        const std::int64_t reading = code();
        stable_ = reading == reading_ ? std::min<std::uint32_t>(stable_, UINT32_MAX - 1) + 1 : 0;
        reading_ = reading;
        if (stable_ < debounce) return;
        marker_ = reading >= 1 && reading <= pockets;
        if (marker_) {
            position_ = reading;
        }
    }

    void look_at_pulses() noexcept {
        const bool both_edges = encoding == Encoding::edge;
        const bool pulse = sense[1];
        marker_ = both_edges || pulse;
        if (!strobe) return;
        const bool changed = pulse != was_pulse_;
        was_pulse_ = pulse;
        const bool at_index = sense[0] && pulse;
        // while it aligns, it passes the same marker again
        const bool aligns = state_ >= State::slows && state_ <= State::returns;
        if (state_ == State::homing && at_index) {
            position_ = 1;
            homed = true;
        } else if (changed && !aligns && marker_) {
            pass_pocket(at_index);
        }
    }
    /// Counts a pocket that was passed; the index is at pocket 1.
    void pass_pocket(bool at_index) noexcept {
        if (at_index) {
            position_ = 1;
        } else if (position_ != 0) {
            position_ = wrapped(position_ + direction_);
        }
    }

    void look_at_counts() noexcept {
        const std::int64_t now = counts;
        if (state_ == State::homing && strobe &&
            (sense[0] || (requested_index_ && !index_enable))) {
            set_home(now + home_offset);
        }
        if (!homed) return;
        const double step = scale != 0 ? static_cast<double>(scale) : 1.0;
        const double turned = static_cast<double>(now - zero_);
        const double pocket = turned / step;

        const double nearest = std::floor(pocket + 0.5);
        const double below = std::floor(pocket);
        const double last_below = std::floor(last_pocket_);
        if (std::fabs(turned - nearest * step) <= std::fabs(static_cast<double>(width))) {
            reach(nearest);
        }
        // it has passed the centre between two cycles
        else if (below > last_below) {
            reach(below);
        } else if (below < last_below) {
            reach(below + 1.0);
        }
        last_pocket_ = pocket;
        marker_ = true;
    }
    void set_home(std::int64_t zero) noexcept {
        zero_ = zero;
        homed = true;
        index_enable = false;
        position_ = 1;
        last_pocket_ = 0.0;
    }
    void reach(double pocket) noexcept {
        position_ = wrapped(1 + static_cast<std::int64_t>(std::clamp(pocket, -1e12, 1e12)));
    }

    // ---- what it does

    /// The motor was switched off during a move, and pulses meanwhile were not counted.
    void abandon() noexcept {
        enter(State::rests);
        if (!absolute() && encoding != Encoding::counts) {
            homed = false;
        }
    }

    void begin() noexcept {
        ready = false;
        if (knows_position()) return set_out();
        requested_index_ = false;
        enter(State::homing);
    }

    void set_out() noexcept {
        target_ = pocket_number == 0 ? position_ : wrapped(pocket_number);
        const std::int64_t ahead = position_ == 0 ? 0 : wrapped(target_ - position_ + 1) - 1;
        direction_ = directions == 1 || 2 * ahead <= pockets ? 1 : -1;
        moved_ = false;
        enter(State::moves);
    }

    void step(double dt) noexcept {
        left_ = std::max(left_ - dt, 0.0);
        switch (state_) {
        case State::rests: break;
        case State::homing: step_homing(); break;
        case State::moves: step_move(); break;
        case State::slows: step_slowdown(); break;
        case State::seeks: enter_if(marker_, State::leaves); break;
        case State::leaves: enter_if(!marker_, State::returns); break;
        case State::returns: step_return(); break;
        case State::locks: step_lock(); break;
        case State::jogging:
            ready = false;
            enter_if(position_ != from_ && marker_, State::rests);
            break;
        }
    }

    void enter_if(bool condition, State next) noexcept {
        if (condition) {
            enter(next);
        }
    }

    void step_homing() noexcept {
        direction_ = 1;
        if (encoding == Encoding::counts && !requested_index_) {
            requested_index_ = true;
            index_enable = true;
        }
        if (!homed) return;
        if (enable) {
            set_out();
        } else {
            enter(State::rests);
        }
    }

    void step_move() noexcept {
        const bool at_target = position_ == target_ && (marker_ || pocket_number == 0);
        if (!at_target) {
            moved_ = true;
        } else if (moved_ && align_dc != 0.0) {
            wait(State::slows, decel_time);
        } else {
            arrive();
        }
    }

    void step_slowdown() noexcept {
        if (left_ > 0.0) return;
        const bool too_short = direction_ > 0 && !marker_;
        enter(too_short ? State::seeks : State::leaves);
    }

    void step_return() noexcept {
        if (marker_) {
            arrive();
        }
    }

    void step_lock() noexcept {
        if (left_ > 0.0) return;
        ready = true;
        enter(State::rests);
    }

    void arrive() noexcept {
        if (rev_pulse > 0.0) return wait(State::locks, rev_pulse);
        ready = true;
        enter(State::rests);
    }
    void wait(State next, double seconds) noexcept {
        left_ = seconds > 0.0 ? std::min(seconds, 1e9) : 0.0;
        enter(next);
    }

    void publish() noexcept {
        int turns = 0;
        double velocity = hold_dc;
        switch (state_) {
        case State::rests: break;
        case State::homing:
        case State::moves:
        case State::jogging:
            turns = direction_;
            velocity = turns > 0 ? fwd_dc : rev_dc;
            break;
        case State::slows: velocity = 0.0; break;
        case State::seeks:
        case State::leaves:
            turns = -1;
            velocity = -std::fabs(align_dc);
            break;
        case State::returns:
            turns = 1;
            velocity = std::fabs(align_dc);
            break;
        case State::locks:
            turns = -1;
            velocity = rev_dc;
            break;
        }
        motor_fwd = turns > 0;
        motor_rev = turns < 0;
        motor_dir = turns;
        motor_vel = velocity;
        active = state_ != State::rests;
        homing = state_ == State::homing;
        state = static_cast<std::int32_t>(state_);
        timer = left_;
        current_position = static_cast<std::int32_t>(knows_position() ? position_ : 0);
    }

    State state_ = State::rests;
    hal::RisingEdge enable_edge_;
    hal::RisingEdge forward_edge_;
    hal::RisingEdge reverse_edge_;
    bool was_pulse_ = false;
    bool marker_ = false;  // at the centre of a pocket
    bool moved_ = false;
    bool requested_index_ = false;
    int direction_ = 1;
    std::uint32_t stable_ = 0;
    std::int64_t reading_ = -1;
    std::int64_t position_ = 0;
    std::int64_t target_ = 0;
    std::int64_t from_ = 0;
    std::int64_t zero_ = 0;
    double left_ = 0.0;
    double last_pocket_ = 0.0;
    hal::Interruption interruption_{*this};
    hal::Retained retained_{*this,
                            {{"state", state_},
                             {"interruption", interruption_},
                             {"was-enabled", enable_edge_},
                             {"was-jog-fwd", forward_edge_},
                             {"was-jog-rev", reverse_edge_},
                             {"was-pulse", was_pulse_},
                             {"marker", marker_},
                             {"moved", moved_},
                             {"requested-index", requested_index_},
                             {"direction", direction_},
                             {"stable", stable_},
                             {"reading", reading_},
                             {"position", position_},
                             {"target", target_},
                             {"from", from_},
                             {"zero", zero_},
                             {"left", left_},
                             {"last-pocket", last_pocket_}}};
};

}  // namespace

HAL_COMPONENT(Carousel, "carousel", "Turns the carousel of a tool changer to a pocket", R"(
A rising edge of `enable` sets `active` and moves to `pocket-number`, in the shorter direction with
`dir=2`; then `active` is FALSE and `ready` TRUE. `enable` FALSE stops the carousel. Pockets are
numbered from 1.

| encoding | sensors |
| --- | --- |
| gray, binary, bcd | `sense-N` are the bits of the pocket's number, sense-0 the lowest; with `parity-error` |
| single | a sensor per pocket, sense-0 for pocket 1 |
| index | sense-1 is TRUE at each pocket, sense-0 also at pocket 1 |
| edge | as index, but both edges of sense-1 are pockets |
| counts | `counts`, `scale` per pocket; sense-0 or the encoder's index (`index-enable`) is the home |

The last three must first find pocket 1: the first `enable` turns forward until the index, even if
`enable` becomes FALSE meanwhile. With `index` and `edge`, each pass of the index corrects the
count. With `counts`, a pocket is reached within `width` of its centre.

A stop of the thread ends a move: it needs another rising edge of `enable`, and with `index` and
`edge` pocket 1 must be found again.

With `align-dc` the carousel stops at the marker for `decel-time`, moves back slowly past the
marker, and forward onto it. With `rev-pulse` it is then driven in reverse against its lock for that
time. At standstill `motor-vel` is `hold-dc`. `jog-fwd` and `jog-rev` move by one pocket while the
carousel is stopped and disabled.

**Differences from LinuxCNC:** the states have other numbers. `enable` FALSE stops a move at once
(LinuxCNC: with `rev-pulse`, `decel-time` and `align-dc`, as at the pocket).

All arguments are lists with an element per carousel (`pockets=10,10,8`); missing elements have the
default value (LinuxCNC repeats the last element).

    loadrt carousel pockets=12 encoding=index names=tools
    addf tools servo
    setp tools.fwd-dc 0.5
    setp tools.rev-dc -0.5
    net tool-number => tools.pocket-number
    net tool-change => tools.enable
    net pocket-1    => tools.sense-0
    net pocket      => tools.sense-1
    net turret-fwd  <= tools.motor-fwd
    net turret-rev  <= tools.motor-rev
    net tool-there  <= tools.ready
)")
