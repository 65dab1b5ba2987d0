// SPDX-License-Identifier: MIT
#include <cstdint>
#include <numbers>

#include "axis_planner.hpp"
#include "hal/component.hpp"
#include "hal/limit.hpp"

namespace {

struct Anglejog : hal::Component {
    using Component::Component;
    hal::In<bool>          enable_in{*this, "enable-in", "TRUE: counts move the axes; FALSE: a new angle and scale are accepted"};
    hal::In<std::int32_t>  counts_in{*this, "counts-in", "counts of the handwheel"};
    hal::In<double>        angle_in{*this, "angle-degrees-in", "direction of the motion", {.unit = "deg"}};
    hal::In<std::int32_t>  factor_in{*this, "iscale-factor", "output counts per input count; at least 1", {.initial = 10000}};
    hal::In<double>        scale_in{*this, "scale-in", "distance per count"};
    hal::Limit             max_velocity{*this, "max-vel", "largest speed along the direction"};
    hal::Limit             max_acceleration{*this, "max-accel", "largest acceleration along the direction"};
    hal::In<double>        accel_fraction{*this, "accel-fraction-in", "fraction of the axes' acceleration to use", {.initial = 1.0}};
    hal::Out<bool>         enable_out{*this, "enable-out", "for jog-enable of both axes"};
    hal::Out<double>       current_scale{*this, "current-scale", "distance per count in use"};
    hal::Out<double>       scale_out{*this, "current-scale-out", "for jog-scale of both axes"};
    hal::Out<std::int32_t> cosine_counts{*this, "coscounts", "for jog-counts of the first axis"};
    hal::Out<std::int32_t> sine_counts{*this, "sincounts", "for jog-counts of the second axis"};
    hal::Out<double>       cosine_fraction{*this, "cos-accel-fraction", "for jog-accel-fraction of the first axis"};
    hal::Out<double>       sine_fraction{*this, "sin-accel-fraction", "for jog-accel-fraction of the second axis"};
    hal::Out<bool>         active{*this, "active", "TRUE while moving"};
    hal::Out<double>       current_angle{*this, "current-angle-degrees", "direction in use", {.unit = "deg"}};
    hal::Out<double>       current_magnitude{*this, "current-mag", "distance along the direction"};
    hal::Out<double>       current_velocity{*this, "current-vel", "speed along the direction"};
    hal::Function          run{*this, "", &Anglejog::update, "computes the counts of both axes"};

    void update(hal::Cycle cycle) noexcept {
        const std::int32_t now = counts_in;
        if (!enable_in) {
            angle_ = std::isfinite(angle_in) ? angle_in.get() : angle_;
            scale_ = std::fabs(scale_in) <= 1e9 ? scale_in.get() : scale_;
            factor_ = std::max(factor_in.get(), 1);
            way_.stop_at_once();
            goal_ = way_.position();
        } else {
            const auto turned = static_cast<std::int32_t>(static_cast<std::uint32_t>(now) - static_cast<std::uint32_t>(last_counts_));
            goal_ = std::clamp(goal_ + static_cast<double>(turned) * scale_, -1e12, 1e12);
            way_.step(&goal_, max_velocity, max_acceleration, cycle.seconds());
        }
        last_counts_ = now;

        const double direction = std::remainder(angle_, 360.0) * (std::numbers::pi / 180.0);
        const double cosine = std::cos(direction), sine = std::sin(direction);
        const double unit = scale_ / static_cast<double>(factor_);
        cosine_counts = counts(way_.position() * cosine, unit);
        sine_counts = counts(way_.position() * sine, unit);
        cosine_fraction = std::fabs(cosine) * accel_fraction;
        sine_fraction = std::fabs(sine) * accel_fraction;
        enable_out = enable_in.get();
        current_scale = scale_;
        scale_out = unit;
        current_angle = angle_;
        current_magnitude = way_.position();
        current_velocity = std::fabs(way_.velocity());
        active = enable_in && (!way_.resting() || !way_.at(goal_));
    }

private:
    static std::int32_t counts(double way, double unit) noexcept {
        if (unit == 0.0) return 0;
        const double exact = way / unit;  // 1e-6 of a count is added: 3 must not become 2.9999999999 and then 2
        return static_cast<std::int32_t>(std::clamp(std::trunc(exact + std::copysign(1e-6, exact)), -2147483648.0, 2147483647.0));
    }
    plan::Axis way_;
    double goal_ = 0.0, angle_ = 0.0, scale_ = 0.0;
    std::int32_t factor_ = 10000, last_counts_ = 0;
};

}  // namespace

HAL_COMPONENT(Anglejog, "anglejog", "Jogs two axes at an angle with one handwheel", R"(
`counts-in` times `scale-in` is a distance along `angle-degrees-in`, covered with at most `max-vel` and `max-accel`. Its cosine component is
`coscounts` for the first axis, its sine component `sincounts` for the second, in units of `current-scale-out` =
scale / `iscale-factor`. New values of angle, scale and factor are accepted while `enable-in` is FALSE, which also discards the remaining distance.
Set `max-vel` and `max-accel` no higher than either axis allows.

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
