// SPDX-License-Identifier: MIT
#include <cstdint>
#include <numbers>
#include <optional>

#include "hal/component.hpp"
#include "hal/retained.hpp"

namespace {

struct EoffsetPerAngle : hal::Component {
    using Component::Component;
    hal::In<bool> active{*this, "active", "TRUE while an offset is active (motion.eoffset-active)"};
    hal::In<bool> is_on{*this, "is-on", "TRUE: the machine is on"};
    hal::In<bool> enable_in{*this, "enable-in", "TRUE computes the offset; FALSE removes it"};
    hal::In<double> radius_ref{*this, "radius-ref", "radius of the part", {.initial = 1.0}};
    hal::In<double> angle{*this, "angle", "angle of the part", {.unit = "deg"}};
    hal::In<double> start_angle{
        *this, "start-angle", "angle at which the shape starts", {.unit = "deg"}};
    hal::In<std::int32_t> fnum{
        *this, "fnum",
        "shape: 0 polygon inside, 1 polygon outside, 2 sine, 3 square wave; others are 0"};
    hal::In<double> rfraction{
        *this, "rfraction", "amplitude as a fraction of radius-ref", {.initial = 0.1}};
    hal::In<double> fmult{
        *this, "fmult", "sides of the polygon, or waves per turn", {.initial = 6.0}};
    hal::In<std::uint32_t> k{*this, "k", "counts per unit; 0 is 10000", {.initial = 10000}};
    hal::Out<bool> is_off{*this, "is-off", "inverse of is-on"};
    hal::Out<bool> enable_out{*this, "enable-out", "for axis.L.eoffset-enable"};
    hal::Out<bool> clear{*this, "clear", "for axis.L.eoffset-clear"};
    hal::Out<std::int32_t> kcounts{*this, "kcounts",
                                   "the offset in counts, for axis.L.eoffset-counts"};
    hal::Out<double> kreciprocal{*this, "kreciprocal", "1 / k, for axis.L.eoffset-scale"};
    hal::Out<double> eoffset{*this, "eoffset-dbg", "the offset"};
    hal::Out<std::uint32_t> state{
        *this, "state-dbg",
        "0 off, 1 ready, 2 running, 3 stopping, 4 finish; of the previous cycle"};
    hal::Function run{*this, "", &EoffsetPerAngle::update, "computes the offset"};

    void update(hal::Cycle) noexcept {
        state = static_cast<std::uint32_t>(state_);
        is_off = !is_on;
        kreciprocal = 1.0 / counts_per_unit();
        if (!is_on) {
            enable_out = false;
            clear = false;
            command(0.0);
            state_ = State::off;
            return;
        }
        switch (state_) {
        case State::off:
            if (!enable_in) {
                become(State::ready);
            }
            break;
        case State::ready:
            if (enable_in) {
                become(State::running);
            }
            break;
        case State::running: follow(); break;
        case State::stopping:
            if (!active) {
                state_ = State::finish;
            }
            break;
        case State::finish:
            enable_out = false;
            clear = false;
            state_ = failed_ ? State::off : State::ready;
            break;
        }
    }

private:
    enum class State : std::uint32_t { off, ready, running, stopping, finish };

    double counts_per_unit() const noexcept { return k != 0 ? static_cast<double>(k) : 10000.0; }

    void command(double offset) noexcept {
        // 1e-6 is added: 2500 must not become 2499.9999999999 and then 2499
        const double exact = offset * counts_per_unit();
        const double counts =
            std::clamp(std::trunc(exact + std::copysign(1e-6, exact)), -2147483648.0, 2147483647.0);
        kcounts = static_cast<std::int32_t>(counts);
        eoffset = counts / counts_per_unit();
    }

    void become(State next) noexcept {
        command(0.0);
        failed_ = false;
        state_ = next;
    }

    void follow() noexcept {
        if (!enable_in) {
            clear = true;
            become(State::stopping);
            return;
        }
        enable_out = true;
        if (const auto shape = value()) {
            command(*shape);
            return;
        }
        become(State::stopping);
        failed_ = true;
    }

    /// Returns the offset at this angle, or nothing for an impossible shape.
    std::optional<double> value() const noexcept {
        const double amplitude = radius_ref * rfraction;

        const double wave = (angle - start_angle) / 360.0 * fmult;
        if (!std::isfinite(amplitude) || !std::isfinite(wave)) {
            return {};
        }
        const double part = wave - std::floor(wave);  // of a wave, or of a side
        if (fnum == 2) return 0.5 * amplitude * (1.0 - std::cos(2.0 * std::numbers::pi * part));
        if (fnum == 3) return part >= 0.25 && part <= 0.75 ? amplitude : 0.0;
        if (fmult <= 2.0) {
            return {};
        }
        // A side is straight: its distance from the centre is that of its middle, divided by the
        // cosine of the angle from there.
        const double turn = 2.0 * std::numbers::pi / fmult;
        const double outer = radius_ref + amplitude;
        const double middle = fnum == 1 ? outer * std::cos(0.5 * turn) : outer;
        return middle / std::cos((part < 0.5 ? part : part - 1.0) * turn) - radius_ref;
    }
    State state_ = State::off;
    bool failed_ = false;  // the shape was impossible
    hal::Retained retained_{*this, {{"state", state_}, {"failed", failed_}}};
};

}  // namespace

HAL_COMPONENT(EoffsetPerAngle, "eoffset_per_angle",
              "An external offset that depends on an angle: polygons and waves on a turned part",
              R"(
With a = `radius-ref` * `rfraction` and t the angle since `start-angle`:

| fnum | offset | |
| --- | --- | --- |
| 0 | (radius-ref + a) / cos(t from the middle of a side) - radius-ref | polygon around the circle of radius-ref + a |
| 1 | the same with the middles at (radius-ref + a) * cos(180 / fmult) | polygon inside of it |
| 2 | a / 2 * (1 - cos(fmult t)) | sine |
| 3 | a in the middle half of each wave, else 0 | square wave |

A polygon needs an `fmult` above 2. `kcounts` is the offset times `k`, truncated. While the machine
is on, `enable-in` starts the offset once it has been FALSE; after its falling edge `clear` is TRUE
until `active` is FALSE. If the shape is impossible, `kcounts` becomes 0, and once `active` is
FALSE, `enable-in` must be FALSE before the offset starts again. Each change of state takes a cycle.

**Differences from LinuxCNC:** a polygon has the same shape at negative angles (LinuxCNC: another
one), `kcounts` is rounded up where it is within 1e-6 of the next count, `clear` becomes FALSE when
the machine is switched off, and nothing is printed.

    loadrt eoffset_per_angle names=opa
    addf opa servo
    setp opa.fnum 1
    setp opa.fmult 4
    setp opa.radius-ref 10
    net c-angle => opa.angle
    net machine-on => opa.is-on
    net go => opa.enable-in
    net x-offset <= opa.kcounts
)")
