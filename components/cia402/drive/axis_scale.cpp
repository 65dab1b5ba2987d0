// SPDX-License-Identifier: MIT
#include "cia402/drive/axis_scale.hpp"

#include <algorithm>
#include <limits>

namespace hal::cia402 {

namespace {

/// Limits a requested acceleration. A limit of 0 means unlimited; a request of 0 selects the limit.
std::uint32_t within(std::uint32_t requested, std::uint32_t limit) noexcept {
    if (limit == 0) return requested;
    if (requested == 0) return limit;
    return std::min(requested, limit);
}

/// The direction in which a rotary axis goes to an absolute target, bits 7 and 6 of 60F2h.
enum class Direction : std::uint8_t { as_linear, negative, positive, shortest };

}  // namespace

void AxisScale::update() noexcept {
    const double increments =
        values_.position_encoder.value() * values_.gear.value() / values_.feed.value();
    speed_ = increments * values_.velocity_factor.value();
    acceleration_ = increments * values_.acceleration_factor.value();
    position_ = (values_.polarity & 0x80) != 0 ? -increments : increments;
    velocity_ = (values_.polarity & 0x40) != 0 ? -speed_ : speed_;
}

double AxisScale::max_speed() const noexcept {
    double limit = motor_.highest_speed;
    if (values_.max_motor_speed != 0) {
        limit = std::min<double>(values_.max_motor_speed, limit);
    }
    return per_second(limit) * motor_.resolution;
}

double AxisScale::acceleration(std::uint32_t requested) const noexcept {
    return acceleration_ * within(requested, values_.max_acceleration);
}

double AxisScale::deceleration(std::uint32_t requested) const noexcept {
    return acceleration_ * within(requested, values_.max_deceleration);
}

double AxisScale::rate_of(const Ramp& ramp) const noexcept {
    return per_second(ramp.speed) / std::max<double>(ramp.time, 1) * motor_.resolution;
}

Profile::Limits AxisScale::profile_limits() const noexcept {
    auto speed = values_.profile_velocity;
    if (values_.max_profile_velocity != 0) {
        speed = std::min(speed, values_.max_profile_velocity);
    }
    return {std::min(speed * speed_, max_speed()), acceleration(values_.profile_acceleration),
            deceleration(values_.profile_deceleration), 0};
}

double AxisScale::corner_time() const noexcept {
    const double jerk = values_.profile_jerk * acceleration_;
    if (values_.motion_profile_type != jerk_limited || !(jerk > 0)) return 0;
    const double steeper = std::max(acceleration(values_.profile_acceleration),
                                    deceleration(values_.profile_deceleration));
    return steeper / jerk;
}

double AxisScale::period() const noexcept {
    double result = values_.interpolation_period;
    for (int n = values_.interpolation_exponent; n < 0; ++n) {
        result /= 10;
    }
    return result;
}

double AxisScale::range_span() const noexcept {
    return static_cast<double>(values_.range_max) - values_.range_min + 1;
}

std::int32_t AxisScale::shown(double encoder) const noexcept {
    const auto value = whole(user(encoder));
    const std::int64_t low = values_.range_min;
    const std::int64_t span = std::int64_t{values_.range_max} - low + 1;
    if (span <= 1) return static_cast<std::int32_t>(value);
    const auto rest = (value - low) % span;
    return static_cast<std::int32_t>(low + (rest < 0 ? rest + span : rest));
}

double AxisScale::absolute(std::int32_t target, double near) const noexcept {
    const double at = user(near);
    const double turn_start = std::round(at) - shown(near);
    const double span = range_span();
    if (span <= 1) return encoder(turn_start + target);
    const double low = values_.range_min;
    double result = turn_start + low + std::fmod(target - low, span);
    if (target < low) {
        result += span;
    }
    switch (static_cast<Direction>(values_.positioning_option >> 6 & 3)) {
    case Direction::as_linear: break;
    case Direction::negative: result -= result > at ? span : 0; break;
    case Direction::positive: result += result < at ? span : 0; break;
    case Direction::shortest: result -= span * std::round((result - at) / span); break;
    }
    return encoder(result);
}

double AxisScale::nearest(std::int32_t target, double near) const noexcept {
    const double span = range_span();
    const double round = span > 1 ? span : 4294967296.0;
    return encoder(target + round * std::round((user(near) - target) / round));
}

Range AxisScale::software_limits() const noexcept {
    using Limits = std::numeric_limits<std::int32_t>;
    constexpr double infinity = std::numeric_limits<double>::infinity();
    const auto low = values_.software_min;
    const auto high = values_.software_max;
    if (low >= high) {
        return {-infinity, infinity};
    }
    const double from = low == Limits::min() ? -infinity : low;
    const double to = high == Limits::max() ? infinity : high;
    if (position_ > 0) {
        return {encoder(from), encoder(to)};
    }
    return {encoder(to), encoder(from)};
}

}  // namespace hal::cia402
