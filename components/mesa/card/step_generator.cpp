// SPDX-License-Identifier: MIT
#include "step_generator.hpp"

#include <algorithm>

namespace hal::mesa {

namespace {

constexpr std::uint64_t one_step = std::uint64_t{1} << 32;

std::uint64_t magnitude_of(std::int32_t rate) noexcept {
    return static_cast<std::uint64_t>(rate < 0 ? -std::int64_t{rate} : std::int64_t{rate});
}

}  // namespace

void StepGenerator::set_rate(std::int32_t rate) noexcept {
    const int direction = rate < 0 ? -1 : 1;
    if (rate != 0 && direction != direction_) {
        direction_ = direction;
        busy_ += std::int64_t{times_.hold} + times_.setup + 2;
    }
    rate_ = rate;
}

void StepGenerator::set_accumulator(std::uint32_t value) noexcept {
    position_ = std::uint64_t{value} << 16;
}

std::int64_t StepGenerator::pulse_clocks() const noexcept {
    return std::int64_t{times_.length} + times_.space + 2;
}

/// The clocks until the accumulator passes the next whole number.
std::int64_t StepGenerator::clocks_to_step() const noexcept {
    const std::uint64_t fraction = position_ % one_step;
    const std::uint64_t distance = rate_ > 0 ? one_step - fraction : fraction + 1;
    const std::uint64_t rate = magnitude_of(rate_);
    return static_cast<std::int64_t>((distance + rate - 1) / rate);
}

/// Adds the rate without looking for steps.
void StepGenerator::pass(std::int64_t clocks) noexcept {
    position_ += static_cast<std::uint64_t>(std::int64_t{rate_} * clocks);
    busy_ = std::max<std::int64_t>(0, busy_ - clocks);
}

/// How far the accumulator is behind the last whole number, in its direction.
std::uint64_t StepGenerator::beyond() const noexcept {
    const std::uint64_t fraction = position_ % one_step;
    return rate_ > 0 ? fraction : one_step - 1 - fraction;
}

/// The clocks behind a step when each step waits for the one before: a step in each `pulse` clocks.
/// How far the accumulator is behind a step changes by -2^32 modulo the rate.
std::int64_t StepGenerator::run_waiting(std::int64_t clocks, std::int64_t pulse) noexcept {
    const std::uint64_t rate = magnitude_of(rate_);
    const std::int64_t steps = clocks / pulse;
    const std::uint64_t before = beyond();
    const std::uint64_t moved = static_cast<std::uint64_t>(steps) % rate * (one_step % rate) % rate;
    const std::uint64_t after = (before % rate + rate - moved) % rate;
    position_ += static_cast<std::uint64_t>(steps * direction_) * one_step;
    position_ += rate_ > 0 ? after - before : before - after;
    busy_ = pulse;
    clocks -= steps * pulse;
    const std::int64_t moves = std::min(clocks, clocks_to_step() - 1);
    pass(moves);
    busy_ = std::max<std::int64_t>(0, busy_ - (clocks - moves));
    return steps * direction_;
}

/// The clocks behind a step. Returns the further steps.
std::int64_t StepGenerator::run(std::int64_t clocks) noexcept {
    const std::int64_t pulse = pulse_clocks();
    const std::uint64_t rate = magnitude_of(rate_);
    if (rate * static_cast<std::uint64_t>(pulse) > one_step) return run_waiting(clocks, pulse);
    const auto before = static_cast<std::uint32_t>(position_ / one_step);
    pass(clocks);
    const std::int32_t steps =
        static_cast<std::int32_t>(static_cast<std::uint32_t>(position_ / one_step) - before);
    if (steps == 0) return 0;
    const auto since_newest = static_cast<std::int64_t>(beyond() / rate);
    busy_ = std::max<std::int64_t>(0, pulse - since_newest);
    return steps;
}

std::int64_t StepGenerator::advance(std::int64_t clocks) noexcept {
    if (rate_ == 0) {
        pass(clocks);
        return 0;
    }
    const std::int64_t due = clocks_to_step();
    const std::int64_t leaves = std::max(due, busy_);
    if (leaves > clocks) {
        const std::int64_t moves = std::min(clocks, due - 1);
        pass(moves);
        busy_ = std::max<std::int64_t>(0, busy_ - (clocks - moves));
        return 0;
    }
    pass(due);
    busy_ = pulse_clocks();
    return direction_ + run(clocks - leaves);
}

}  // namespace hal::mesa
