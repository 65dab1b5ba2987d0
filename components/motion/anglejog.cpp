// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "hal/component.hpp"
#include "hal/edge.hpp"
#include "hal/interruption.hpp"
#include "hal/limit.hpp"
#include "hal/retained.hpp"

namespace {

struct Anglejog : hal::Component {
    using Component::Component;
    hal::In<bool> enable_in{
        *this, "enable-in",
        "TRUE: counts move the axes; FALSE: a new angle and scale are accepted"};
    hal::In<std::int32_t> counts_in{*this, "counts-in", "counts of the handwheel"};
    hal::In<double> angle_in{*this, "angle-degrees-in", "direction of the motion", {.unit = "deg"}};
    hal::In<std::int32_t> factor_in{
        *this, "iscale-factor", "output counts per input count, 10..100000", {.initial = 10000}};
    hal::In<double> scale_in{*this, "scale-in", "distance per count"};
    hal::Limit max_velocity{*this, "max-vel", "largest speed along the direction"};
    hal::Limit max_acceleration{*this, "max-accel", "largest acceleration along the direction"};
    hal::In<double> accel_fraction{
        *this, "accel-fraction-in", "fraction of the axes' acceleration to use", {.initial = 1.0}};
    hal::Out<bool> enable_out{*this, "enable-out", "for jog-enable of both axes"};
    hal::Out<double> current_scale{*this, "current-scale", "distance per count in use"};
    hal::Out<double> scale_out{*this, "current-scale-out", "for jog-scale of both axes"};
    hal::Out<std::int32_t> cosine_counts{*this, "coscounts", "for jog-counts of the first axis"};
    hal::Out<std::int32_t> sine_counts{*this, "sincounts", "for jog-counts of the second axis"};
    hal::Out<double> cosine_fraction{*this, "cos-accel-fraction",
                                     "for jog-accel-fraction of the first axis"};
    hal::Out<double> sine_fraction{*this, "sin-accel-fraction",
                                   "for jog-accel-fraction of the second axis"};
    hal::Out<bool> active{*this, "active", "TRUE while moving"};
    hal::Out<double> current_angle{
        *this, "current-angle-degrees", "direction in use", {.unit = "deg"}};
    hal::Out<double> current_magnitude{*this, "current-mag", "distance along the direction"};
    hal::Out<double> current_velocity{
        *this, "current-vel", "speed along the direction, signed", {.safe = 0.0}};
    hal::Function run{*this, "", &Anglejog::update, "computes the counts of both axes"};

    void update(hal::Cycle cycle) noexcept {
        const bool enabled = enable_in;
        if (!started_) {
            adopt();
        }
        started_ = true;
        const std::int64_t now = std::int64_t{factor_} * counts_in;
        if (enable_edge_.rises(enabled)) {
            last_counts_ = now;
            waiting_ = true;
            commanded_counts_ = counts_at(magnitude_);
        }
        const std::int64_t turned = now - last_counts_;
        last_counts_ = now;
        if (turned != 0) {
            waiting_ = false;
        }
        if (enabled) {
            commanded_counts_ += turned;
        } else {
            adopt();
        }

        if (interruption_.accept()) {
            velocity_ = 0.0;
        }
        const double distance = static_cast<double>(commanded_counts_) * unit_ - magnitude_;
        active = move(enabled && !waiting_ ? distance : 0.0, cycle.seconds());
        enable_out = enabled;
        publish();
    }

private:
    static constexpr std::int32_t min_factor = 10;
    static constexpr std::int32_t max_factor = 100'000;
    static constexpr double huge = 1e20;  // beyond it sums would lose all digits, or overflow

    static double at_least_0(double limit) noexcept {
        return limit > 0.0 ? std::min(limit, huge) : 0.0;
    }

    /// Accepts the angle, the scale and the factor. NaN and a factor out of range change nothing.
    void adopt() noexcept {
        if (std::isfinite(angle_in)) {
            angle_ = angle_in;
        }
        const bool valid = factor_in >= min_factor && factor_in <= max_factor;
        if (valid) {
            factor_ = factor_in;
        }
        if (std::fabs(scale_in) <= 1e9) {
            scale_ = scale_in;
        }
        unit_ = scale_ / static_cast<double>(factor_);
        commanded_counts_ = counts_at(magnitude_);
    }

    /// Moves for one cycle to a point `distance` ahead, or brakes to a stop if that is 0. Returns
    /// true while it moves.
    bool move(double distance, double period_s) noexcept {
        const double acceleration = at_least_0(max_acceleration);
        const double fastest = at_least_0(max_velocity);
        const double change = acceleration * period_s;
        const double negligible = change * period_s * 0.001;
        const bool going = std::fabs(distance) > negligible;
        // The speed v from which braking by `change` in each cycle ends at the distance d: v * v +
        // 2 v change = 2 a d.
        const double braking =
            std::sqrt(2.0 * acceleration * std::fabs(distance) + change * change) - change;
        const double speed = going ? std::min(braking, fastest) : 0.0;
        velocity_ =
            std::clamp(std::copysign(speed, distance), velocity_ - change, velocity_ + change);
        magnitude_ += velocity_ * period_s;
        return going || velocity_ != 0.0;
    }

    void publish() noexcept {
        const double direction = angle_ * (std::numbers::pi / 180.0);
        const double cosine = std::cos(direction);
        const double sine = std::sin(direction);
        cosine_counts = static_cast<std::int32_t>(counts_at(magnitude_ * cosine));
        sine_counts = static_cast<std::int32_t>(counts_at(magnitude_ * sine));
        cosine_fraction = std::fabs(cosine) * accel_fraction;
        sine_fraction = std::fabs(sine) * accel_fraction;
        current_scale = scale_;
        scale_out = unit_;
        current_angle = angle_;
        current_magnitude = magnitude_;
        current_velocity = velocity_ + 0.0;  // never -0
    }

    /// Returns `distance` in output counts, truncated, within s32.
    std::int64_t counts_at(double distance) const noexcept {
        if (unit_ == 0.0) return 0;
        return static_cast<std::int64_t>(std::clamp(distance / unit_, -2147483648.0, 2147483647.0));
    }

    bool started_ = false;
    hal::RisingEdge enable_edge_;
    bool waiting_ = false;  // for the first count since enable-in became TRUE
    double angle_ = 0.0;
    double scale_ = 0.0;
    double unit_ = 0.0;  // distance per output count
    double magnitude_ = 0.0;
    double velocity_ = 0.0;
    std::int32_t factor_ = 10000;
    std::int64_t last_counts_ = 0;
    std::int64_t commanded_counts_ = 0;
    hal::Interruption interruption_{*this};
    hal::Retained retained_{*this,
                            {{"started", started_},
                             {"interruption", interruption_},
                             {"was-enabled", enable_edge_},
                             {"waiting", waiting_},
                             {"angle", angle_},
                             {"scale", scale_},
                             {"unit", unit_},
                             {"magnitude", magnitude_},
                             {"velocity", velocity_},
                             {"factor", factor_},
                             {"last-counts", last_counts_},
                             {"commanded-counts", commanded_counts_}}};
};

}  // namespace

HAL_COMPONENT(Anglejog, "anglejog", "Jogs two axes at an angle with one handwheel", R"(
`counts-in` times `scale-in` is a distance along `angle-degrees-in`, covered with at most `max-vel`
and `max-accel`. Its cosine component is `coscounts` for the first axis, its sine component
`sincounts` for the second, in units of `current-scale-out` = scale / `iscale-factor`. New values of
angle, scale and factor are accepted while `enable-in` is FALSE, which also discards the remaining
distance: the motion brakes with `max-accel`. It stops within a thousandth of the distance of the
first cycle of an acceleration. Set `max-vel` and `max-accel` no higher than either axis allows.

**Differences from LinuxCNC:** the acceleration fractions are positive in all directions (LinuxCNC:
with the sign of cosine and sine, and the motion controller takes a negative one as 1). Disabled and
enabled again while it brakes, the motion goes on braking (LinuxCNC: the speed is held until the
wheel turns). NaN inputs and a factor out of range change nothing; negative limits count as 0
(LinuxCNC: NaN).

    loadrt anglejog names=aj
    addf aj servo
    setp aj.scale-in 0.01
    setp aj.max-vel 20
    setp aj.max-accel 200
    setp aj.angle-degrees-in 30
    net wheel  => aj.counts-in
    net jogging => aj.enable-in
    net x-jog-counts <= aj.coscounts
    net y-jog-counts <= aj.sincounts
    net jog-scale    <= aj.current-scale-out
)")
