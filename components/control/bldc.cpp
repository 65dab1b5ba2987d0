// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <iterator>
#include <numbers>
#include <optional>
#include <string>

#include "bldc_angles.hpp"
#include "hal/component.hpp"
#include "hal/corrected.hpp"
#include "hal/edge.hpp"
#include "hal/retained.hpp"

namespace {

/// What the letters of cfg= select.
struct Config {
    explicit Config(const std::string& text) {
        struct Letter {
            char letter;
            bool Config::* flag;
        };
        constexpr Letter letters[] = {{'h', &Config::hall},     {'a', &Config::absolute},
                                      {'q', &Config::counting}, {'i', &Config::index},
                                      {'f', &Config::gray},     {'B', &Config::bits},
                                      {'6', &Config::six},      {'H', &Config::hall_out},
                                      {'F', &Config::gray_out}, {'T', &Config::trapezoid}};
        for (const char letter : text) {
            if (letter == 'n') continue;
            const auto* const found = std::ranges::find(letters, letter, &Letter::letter);
            if (found == std::end(letters)) {
                throw std::invalid_argument(std::string("cfg has the letter '") + letter +
                                            "'; it may have n h a q i f B 6 H F T");
            }
            this->*found->flag = true;
        }
    }
    bool hall = false;
    bool absolute = false;
    bool counting = false;
    bool index = false;
    bool gray = false;
    bool bits = false;
    bool six = false;
    bool hall_out = false;
    bool gray_out = false;
    bool trapezoid = false;
    bool encoder() const { return absolute || counting; }
    bool aligns() const { return counting && !hall && !absolute; }
    bool free() const { return !hall && !encoder() && !index; }
    /// The field leads the rotor; without a sensor of its angle there is no rotor to lead.
    bool leads() const { return hall || encoder() || (gray && !index); }
    bool phases() const { return !hall_out && !gray_out; }
};

struct Bldc : hal::Component {
    using Component::Component;
    hal::TextArgument cfg{*this,
                          "cfg",
                          "n",
                          "letters for inputs and outputs, a group per instance",
                          {.per_instance = true}};
    const Config has{cfg.get()};

    hal::Ins<bool> hall{*this, "hall#", has.hall ? 3 : 0, 1, "Hall sensor #"};
    hal::Outs<bool> hall_error{
        *this, "hall-error", has.hall,
        "TRUE after a Hall code outside of the pattern, until the pattern is changed"};
    std::array<std::optional<hal::In<bool>>, 4> gray;
    hal::In<double> value{*this, "value", "amplitude; a negative value reverses the direction"};
    hal::Ins<double> lead_angle{*this,
                                "lead-angle",
                                has.encoder(),
                                "angle by which the field leads the rotor",
                                {.initial = 90.0, .unit = "deg"}};
    hal::In<bool> rev{*this, "rev", "TRUE reverses the direction"};
    hal::Ins<double> frequency{*this,
                               "frequency",
                               has.free(),
                               "electrical turns of the field per second (open loop)",
                               {.unit = "Hz"}};
    hal::Ins<double> init_value{
        *this, "initvalue", has.counting, "amplitude while aligning", {.initial = 0.2}};
    hal::Ins<std::int32_t> raw_counts{*this, "rawcounts", has.encoder(),
                                      "encoder counts that the index does not reset"};
    hal::Ios<bool> index_enable{*this, "index-enable", has.index,
                                "TRUE: waits for the encoder's index"};
    hal::Ins<bool> init{*this, "init", has.aligns(), "rising edge: aligns the motor"};
    hal::Outs<bool> init_done{*this, "init-done", has.aligns(), "TRUE: the motor is aligned"};

    std::array<std::optional<hal::Out<double>>, 6> levels;  // A B C, or A-high A-low B-high ...
    std::array<std::optional<hal::Out<bool>>, 6> switches;
    hal::Outs<bool> hall_out{*this, "hall#-out", has.hall_out ? 3 : 0, 1, "emulated Hall sensor #"};
    std::array<std::optional<hal::Out<bool>>, 4> gray_out;
    hal::Out<double> phase_angle{*this,
                                 "phase-angle",
                                 "angle of the field, 0 to 1 per electrical turn",
                                 {.unit = "turn", .finite = true}};
    hal::Out<double> rotor_angle{*this,
                                 "rotor-angle",
                                 "angle of the rotor, 0 to 1 per electrical turn",
                                 {.unit = "turn", .finite = true}};
    hal::Out<double> out{
        *this, "out", "amplitude in use, with its sign", {.safe = 0.0, .finite = true}};
    hal::Out<bool> out_dir{*this, "out-dir", "TRUE: out is negative"};
    hal::Out<double> out_abs{*this, "out-abs", "magnitude of out", {.safe = 0.0, .finite = true}};

    hal::Out<std::int32_t> in_type{
        *this,
        "in-type",
        "source of the angle: 0 frequency, 1 Hall, 2 encoder, 3 Gray code, 4 alignment, 5 none yet",
        {.initial = -1}};
    hal::Out<std::int32_t> out_type{*this, "out-type", "0 sine, 1 trapezoid", {.initial = -1}};
    hal::Params<std::int32_t> scale{
        *this, "scale", has.encoder(), "counts per turn of the motor", {.initial = 512}};
    hal::Params<std::int32_t> poles{
        *this, "poles", has.encoder(), "magnetic poles; two per electrical turn", {.initial = 4}};
    hal::Params<std::int32_t> encoder_offset{
        *this, "encoder-offset", has.absolute || has.index,
        "counts at the motor's zero, from the encoder's zero or index"};
    hal::Outs<std::int32_t> offset_measured{*this, "offset-measured", has.counting,
                                            "counts at the motor's zero, as found"};
    hal::Param<double> drive_offset{
        *this,
        "drive-offset",
        "offset that the drive adds to rotor-angle; used while aligning",
        {.unit = "deg"}};
    hal::Params<std::uint32_t> output_pattern{
        *this, "output-pattern", has.hall_out, "Hall pattern to emulate, 0 to 47", {.initial = 25}};
    hal::Pins<hal::CorrectedParam<std::uint32_t>, std::uint32_t> pattern{
        *this, "pattern", has.hall, "Hall pattern of the motor, 0 to 47", {.initial = 25}};

    hal::Function run{*this, "", &Bldc::update, "computes angles and phases"};

    explicit Bldc(const hal_host* host);

    void update(hal::Cycle cycle) noexcept {
        amplitude_ = std::fabs(value) <= 1e300 ? value.get() : 0.0;
        if (rev) {
            amplitude_ = -amplitude_;
        }
        trapezoid_ = has.trapezoid || (has.bits && has.six);
        count();
        double rotor = 0.0;
        if (has.encoder() && found()) {
            rotor = from_encoder();
        } else if (has.hall) {
            rotor = from_hall();
        } else if (has.counting) {
            rotor = align(cycle.seconds());
        } else if (has.gray) {
            source_ = 3;
            rotor = from_gray();
        } else {
            source_ = 0;
            rotor = advance(cycle.seconds());
        }
        publish(bldc::fraction(rotor));
    }

private:
    /// The motor's zero is known.
    bool found() const noexcept { return has.absolute || state_ == State::found; }
    double per_turn() const noexcept {  // counts per electrical turn
        const double turns = 0.5 * static_cast<double>(poles[0]);
        return scale[0] != 0 && turns != 0.0 ? static_cast<double>(scale[0]) / turns : 1.0;
    }

    void count() noexcept {
        if (!has.encoder()) return;
        const std::int32_t raw = raw_counts[0];
        if (!started_) {
            started_ = true;
            counts_ = last_raw_ = raw;
        }
        // By differences, so that an overflow of the counter causes no jump.
        moved_ = static_cast<std::int32_t>(static_cast<std::uint32_t>(raw) -
                                           static_cast<std::uint32_t>(last_raw_));
        counts_ += moved_;
        last_raw_ = raw;
        if (has.aligns()) {
            follow_init();
        } else if (has.index && !found()) {
            find_index();
        }
    }

    void follow_init() noexcept {
        if (init_edge_.rises(init[0])) {
            state_ = State::aligning;
            elapsed_ = 0.0;
            if (has.index) {
                index_enable[0] = true;
            }
        }
        if (has.index && state_ == State::aligning && !index_enable[0]) {
            set_zero(counts_ + encoder_offset[0]);
        }
        init_done[0] = state_ == State::found;
    }

    void find_index() noexcept {
        if (state_ == State::waiting) {
            index_enable[0] = true;
            state_ = State::aligning;
        } else if (!index_enable[0]) {
            set_zero(counts_ + encoder_offset[0]);
        }
    }

    void set_zero(std::int64_t counts) noexcept {
        offset_ = counts;
        offset_measured[0] = static_cast<std::int32_t>(counts);
        state_ = State::found;
        if (has.aligns()) {
            init_done[0] = true;
        }
    }

    double from_encoder() noexcept {
        source_ = 2;
        // The outputs hold until the next cycle: use the rotor angle half a period ahead.
        const std::int64_t zero = has.absolute ? encoder_offset[0] : offset_;
        return (static_cast<double>(counts_ - zero) + 0.5 * static_cast<double>(moved_)) /
               per_turn();
    }

    double from_hall() noexcept {
        source_ = 1;
        trapezoid_ = true;
        apply_pattern();
        const unsigned code = unsigned{hall[0]} << 2 | unsigned{hall[1]} << 1 | unsigned{hall[2]};
        const int state = bldc::state_of(code, used_pattern_);
        const bool valid = state >= 0;
        const int moved = valid && hall_state_ >= 0 ? (state - hall_state_ + 9) % 6 - 3 : 0;
        error_ = error_ || !valid || std::abs(moved) > 1;
        hall_error[0] = error_;
        const double centre = static_cast<double>(state + 1) / 6.0;
        // the edge between two states is an exact angle
        if (std::abs(moved) == 1 && has.counting && !has.index && !has.absolute) {
            const double edge = centre - static_cast<double>(moved) / 12.0;
            set_zero(counts_ - static_cast<std::int64_t>(
                                   std::clamp(std::round(edge * per_turn()), -1e9, 1e9)));
        }
        if (valid) {
            hall_state_ = state;
        } else {
            amplitude_ = 0.0;
        }
        return centre;
    }

    void apply_pattern() noexcept {
        if (pattern[0] >= bldc::pattern_count) {
            pattern[0].correct(0);
        }
        if (pattern[0] == used_pattern_) return;
        used_pattern_ = pattern[0];
        hall_state_ = -1;
        error_ = false;
    }

    double from_gray() const noexcept {
        unsigned code = 0;
        unsigned binary = 0;
        for (unsigned i = 0; i < 4; ++i) {
            code |= *gray[i] ? 1u << i : 0u;
        }
        for (; code != 0; code >>= 1) {
            binary ^= code;
        }
        return (static_cast<double>(binary) + 0.5) / 16.0;
    }

    double advance(double dt) noexcept {
        if (has.free() && std::isfinite(frequency[0])) {
            const double step = bldc::fraction(frequency[0] * dt);
            free_angle_ = bldc::fraction(free_angle_ + (amplitude_ < 0.0 ? -step : step));
        }
        return free_angle_;
    }

    // With an index: turns slowly until the index. Without: ramps up the current at angle 0, then
    // swings the field to both sides with decreasing amplitude, so that a rotor exactly opposite
    // does not stay there.
    double align(double dt) noexcept {
        const double current = std::fabs(init_value[0]) <= 1e300 ? init_value[0].get() : 0.0;
        source_ = state_ == State::aligning ? 4 : 5;
        if (state_ != State::aligning) return amplitude_ = 0.0;
        elapsed_ = std::min(elapsed_ + dt, 1e6);
        if (has.index) {
            amplitude_ = rev ? -current : current;
            return bldc::fraction(rev ? -elapsed_ : elapsed_);
        }
        constexpr double rise = 0.5;
        constexpr double swing = 2.0;
        constexpr double rest = 0.5;
        amplitude_ = current * std::min(elapsed_ / rise, 1.0);
        if (elapsed_ >= rise + swing + rest) {
            set_zero(counts_);
        }
        const double t = elapsed_ - rise;
        return t > 0.0 && t < swing ? 0.2 * (1.0 - t / swing) * std::sin(2.0 * std::numbers::pi * t)
                                    : 0.0;
    }

    /// Returns the angle by which the field leads the rotor, in turns.
    double lead() const noexcept {
        if (source_ >= 4) return 0.0;
        if (has.encoder() && std::isfinite(lead_angle[0])) return lead_angle[0] / 360.0;
        return has.leads() ? 0.25 : 0.0;
    }

    void publish(double rotor) noexcept {
        const bool is_negative = amplitude_ < 0.0;
        const double size = std::fabs(amplitude_);
        const double phase = bldc::fraction(is_negative ? rotor - lead() : rotor + lead());
        const double back =
            source_ == 4 && std::isfinite(drive_offset) ? drive_offset / 360.0 : 0.0;
        rotor_angle = bldc::fraction(rotor - back);
        phase_angle = phase;
        out = amplitude_;
        out_abs = size;
        out_dir = is_negative;
        in_type = source_;
        out_type = trapezoid_ ? 1 : 0;
        if (has.phases()) {
            drive(phase, size);
        }
        if (has.hall_out) {
            emulate_hall(bldc::code_of(rotor, output_pattern[0]));
        }
        if (has.gray_out) {
            emulate_gray(static_cast<unsigned>(rotor * 16.0) & 15u);
        }
    }

    void emulate_hall(unsigned code) noexcept {
        for (unsigned i = 0; i < 3; ++i) {
            hall_out[i] = (code >> (2 - i) & 1u) != 0;
        }
    }

    void emulate_gray(unsigned sector) noexcept {
        const unsigned code = sector ^ (sector >> 1);
        for (unsigned i = 0; i < 4; ++i) {
            *gray_out[i] = (code >> i & 1u) != 0;
        }
    }

    void drive(double phase, double size) noexcept {
        const auto values = trapezoid_ ? bldc::trapezoid(phase) : bldc::sine(phase);
        for (std::size_t i = 0; i < 3; ++i) {
            const double v = values[i] * size;
            if (has.bits && has.six) {
                *switches[2 * i] = v > 0.0;
                *switches[2 * i + 1] = v < 0.0;
            } else if (has.bits) {
                *switches[i] = v > 0.0;
            } else if (has.six) {
                *levels[2 * i] = v > 0.0 ? v : 0.0;
                *levels[2 * i + 1] = v < 0.0 ? -v : 0.0;
            } else {
                *levels[i] = v + 0.0;
            }
        }
    }

    enum class State : std::uint8_t { waiting, aligning, found };
    State state_ = State::waiting;
    bool started_ = false;
    hal::RisingEdge init_edge_;
    bool trapezoid_ = false;
    bool error_ = false;
    int source_ = 0;
    int hall_state_ = -1;
    std::uint32_t used_pattern_ = 25;
    std::int64_t counts_ = 0;
    std::int64_t offset_ = 0;
    std::int32_t last_raw_ = 0;
    std::int32_t moved_ = 0;
    double amplitude_ = 0.0;
    double free_angle_ = 0.0;
    double elapsed_ = 0.0;
    hal::Retained retained_{*this,
                            {{"state", state_},
                             {"started", started_},
                             {"was-init", init_edge_},
                             {"trapezoid", trapezoid_},
                             {"error", error_},
                             {"source", source_},
                             {"hall-state", hall_state_},
                             {"used-pattern", used_pattern_},
                             {"counts", counts_},
                             {"offset", offset_},
                             {"last-raw", last_raw_},
                             {"moved", moved_},
                             {"amplitude", amplitude_},
                             {"free-angle", free_angle_},
                             {"elapsed", elapsed_}}};
};

Bldc::Bldc(const hal_host* host) : Component(host) {
    constexpr const char* bits[] = {"C1", "C2", "C4", "C8"};
    for (std::size_t i = 0; i < 4; ++i) {
        if (has.gray) {
            gray[i].emplace(*this, bits[i], "bit of the Gray code of a Fanuc motor");
        }
        if (has.gray_out) {
            gray_out[i].emplace(*this, (std::string(bits[i]) + "-out").c_str(),
                                "bit of the emulated Gray code");
        }
    }
    if (!has.phases()) return;
    const hal::PinOptions<bool> off{.safe = false};
    const hal::PinOptions<double> zero{.safe = 0.0, .finite = true};
    std::size_t i = 0;
    for (const std::string phase : {"A", "B", "C"}) {
        for (const char* side : {"-high", "-low"}) {
            if (!has.six && side[1] == 'l') break;
            const std::string name = has.six ? phase + side : phase;
            if (has.bits) {
                switches[i].emplace(*this, (name + "-on").c_str(),
                                    "TRUE: this phase, or this side of it, conducts", off);
            } else {
                levels[i].emplace(*this, (has.six ? name : name + "-value").c_str(),
                                  "amplitude of this phase, or this side of it", zero);
            }
            ++i;
        }
    }
}

}  // namespace

HAL_COMPONENT(Bldc, "bldc", "Commutation of a three-phase motor: from its feedback to the drive",
              R"(
`cfg=` has a group of letters per instance: lower case for the motor's feedback, upper case for the
drive's inputs.

| input | | output | |
| --- | --- | --- | --- |
| n | no feedback: the field turns at `frequency` | (none) | A-value, B-value, C-value |
| h | Hall sensors | 6 | two numbers per phase, high and low side |
| a | absolute encoder | B | a bit per phase |
| q | incremental encoder, has to find its zero | B6 | two bits per phase |
| i | index of the encoder | H | emulated Hall sensors |
| f | 4-bit Gray code of Fanuc "red cap" motors | F | emulated Gray code |
| | | T | trapezoid instead of sine |

The angle of the field, `phase-angle`, leads `rotor-angle` by `lead-angle` (90 degrees without that
pin), or lags it when `out` is negative. Motor zero is the rotor position with A positive, B and C
negative. With sine outputs A = cos(phase), and B and C are a third of a turn later and earlier; a
trapezoid drives the two phases nearest to the angle, each for a third of a turn. The angle of an
encoder is extrapolated by half a period, because the outputs hold for a period. H and F have no
phase outputs.

**Finding zero.** *a*: known, at `encoder-offset` counts. *qh*: trapezoid from the Hall sensors
until their first edge. *qhi*: the same until the index, which is `encoder-offset` counts before
zero. *qi*: a rising edge of `init` turns the field at one electrical turn per second with the
amplitude `initvalue` until the index. *q*: `init` pulls the rotor to zero with the amplitude
`initvalue`, in three seconds. Until zero is found, the outputs are 0. Link `rawcounts` to the
encoder's pin of that name.

**Hall patterns** 0..47 (25: 60 degrees, 26: its reverse, 0: 30 degrees, 17: 120 degrees).
`hall-error` is TRUE after a code outside of the pattern, which also sets all outputs to 0, and
after a skipped state. A `pattern` above 47 is set to 0.

**Differences from LinuxCNC:** the first cycle sets the outputs (LinuxCNC: they remain 0). A
trapezoid follows `phase-angle` (LinuxCNC: `rotor-angle`, without `lead-angle`). A code outside of
the Hall pattern sets the outputs to 0 (LinuxCNC keeps driving). The angle is extrapolated by
fractions of a count (LinuxCNC: whole counts). `in-type` and `out-type` have other numbers.

    loadrt bldc cfg=qh names=spindle
    addf spindle servo
    setp spindle.scale 4000
    setp spindle.poles 8
    net torque     => spindle.value
    net raw-counts => spindle.rawcounts
    net hall-1     => spindle.hall1
    net hall-2     => spindle.hall2
    net hall-3     => spindle.hall3
    net phase-u    <= spindle.A-value
    net phase-v    <= spindle.B-value
    net phase-w    <= spindle.C-value

**Differences from LinuxCNC:** in LinuxCNC, trapezoids and emulated Hall sensors from an encoder
lead by 60 degrees more than `lead-angle`, `phase-angle` from Hall sensors alone has the wrong sign,
the bits of three outputs are not symmetrical, and a negative `value` does not reverse a field
without feedback.
)")
