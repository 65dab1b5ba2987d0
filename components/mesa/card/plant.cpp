// SPDX-License-Identifier: MIT
#include "plant.hpp"

#include <algorithm>
#include <cmath>

namespace hal::mesa {

namespace {

std::int64_t rounded(double value) { return std::llround(std::clamp(value, -4e18, 4e18)); }

}  // namespace

Plant::Plant(const CardConfig& config) : config_(config), spindles_(config.spindles.size()) {
    const auto add = [&](bool is_spindle, std::size_t part, unsigned encoder, double scale,
                         double index_every) {
        Feedback feedback{is_spindle, part, scale, 0.0};
        feedback.edges = unit_of(feedback) * scale;
        EncoderMotion motion;
        motion.encoder = encoder;
        motion.from = motion.to = static_cast<std::int64_t>(std::floor(feedback.edges));
        motion.index_every = rounded(std::fabs(index_every * scale));
        feedbacks_.push_back(feedback);
        encoders_.push_back(motion);
    };
    for (std::size_t n = 0; n < config.motors.size(); ++n) {
        const MotorConfig& motor = config.motors[n];
        const std::int64_t one = rounded(motor.min * motor.scale);
        const std::int64_t other = rounded(motor.max * motor.scale);
        motors_.push_back(
            {rounded(motor.start * motor.scale), std::min(one, other), std::max(one, other), 0});
        if (motor.encoder) {
            add(false, n, *motor.encoder, motor.encoder_scale, motor.index_every);
        }
    }
    for (std::size_t n = 0; n < config.spindles.size(); ++n) {
        const SpindleConfig& spindle = config.spindles[n];
        if (spindle.encoder) {
            add(true, n, *spindle.encoder, spindle.edges, 1.0);
        }
    }
}

void Plant::step(unsigned stepgen, std::int64_t steps) noexcept {
    for (std::size_t n = 0; n < motors_.size(); ++n) {
        if (config_.motors[n].stepgen != stepgen) continue;
        Motor& motor = motors_[n];
        const std::int64_t wanted = motor.steps + steps;
        motor.steps = std::clamp(wanted, motor.min, motor.max);
        motor.lost += static_cast<std::uint64_t>(std::abs(wanted - motor.steps));
    }
}

double Plant::unit_of(const Feedback& feedback) const noexcept {
    return feedback.is_spindle ? spindles_[feedback.part].turns : position(feedback.part);
}

double Plant::position(std::size_t motor) const noexcept {
    return static_cast<double>(motors_[motor].steps) / config_.motors[motor].scale;
}

void Plant::advance(double seconds) noexcept {
    for (std::size_t n = 0; n < spindles_.size(); ++n) {
        Spindle& spindle = spindles_[n];
        const double constant = static_cast<double>(config_.spindles[n].time_constant_ns) / 1e9;
        const double share = 1.0 - std::exp(-seconds / constant);
        spindle.rpm += (spindle.command * config_.spindles[n].max_rpm - spindle.rpm) * share;
        spindle.turns += spindle.rpm / 60.0 * seconds;
    }
    for (std::size_t n = 0; n < feedbacks_.size(); ++n) {
        Feedback& feedback = feedbacks_[n];
        EncoderMotion& motion = encoders_[n];
        const double edges = unit_of(feedback) * feedback.edges_per_unit;
        motion.from = motion.to;
        motion.to = static_cast<std::int64_t>(std::floor(edges));
        const double moved = edges - feedback.edges;
        const double newest = static_cast<double>(moved > 0.0 ? motion.to : motion.to + 1);
        motion.newest_edge =
            moved == 0.0 ? 1.0 : std::clamp((newest - feedback.edges) / moved, 0.0, 1.0);
        feedback.edges = edges;
    }
}

bool Plant::has_encoder(unsigned encoder) const noexcept {
    return std::ranges::any_of(
        encoders_, [&](const EncoderMotion& motion) { return motion.encoder == encoder; });
}

bool Plant::is_closed_at(const SwitchConfig& one, double position) const noexcept {
    const bool is_below = one.below && position < *one.below;
    const bool is_there = is_below || (one.above && position > *one.above);
    return is_there != one.normally_closed;
}

bool Plant::is_closed(std::size_t switch_index) const noexcept {
    const SwitchConfig& one = config_.switches[switch_index];
    return is_closed_at(one, position(one.motor_index));
}

std::optional<std::size_t> Plant::indexed_motor(unsigned stepgen) const noexcept {
    for (std::size_t n = 0; n < config_.motors.size(); ++n) {
        const MotorConfig& motor = config_.motors[n];
        const bool has_index = motor.index_every != 0.0 && !motor.encoder;
        if (motor.stepgen == stepgen && has_index) return n;
    }
    return {};
}

std::optional<std::int64_t> Plant::step_of_change(std::size_t switch_index, std::int64_t from,
                                                  std::int64_t to) const noexcept {
    const SwitchConfig& one = config_.switches[switch_index];
    const double scale = config_.motors[one.motor_index].scale;
    const auto is_closed_behind = [&](std::int64_t steps) {
        return is_closed_at(one, static_cast<double>(steps) / scale);
    };
    const bool before = is_closed_behind(from);
    if (is_closed_behind(to) == before) return {};
    // `from` is before the change, and `to` behind it
    while (std::abs(to - from) > 1) {
        const std::int64_t middle = from + (to - from) / 2;
        (is_closed_behind(middle) == before ? from : to) = middle;
    }
    return to;
}

std::optional<std::int64_t> Plant::step_of_index(std::size_t motor, std::int64_t from,
                                                 std::int64_t to, bool level) const noexcept {
    const MotorConfig& config = config_.motors[motor];
    const std::int64_t every = std::abs(rounded(config.index_every * config.scale));
    if (every < 2 || from == to) return {};
    const std::int64_t direction = to > from ? 1 : -1;
    // the index ends a step behind its position
    const std::int64_t shift = level ? 0 : direction;
    const std::int64_t next = (from - shift) * direction + 1;
    const std::int64_t remainder = (next % every + every) % every;
    const std::int64_t first = next + (remainder == 0 ? 0 : every - remainder);
    const std::int64_t at = first * direction + shift;
    const bool is_within = direction > 0 ? at <= to : at >= to;
    if (!is_within) return {};
    return at;
}

}  // namespace hal::mesa
