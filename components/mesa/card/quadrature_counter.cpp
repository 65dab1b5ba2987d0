// SPDX-License-Identifier: MIT
#include "quadrature_counter.hpp"

#include <algorithm>

#include "mesa/hostmot2/registers.hpp"

namespace hal::mesa {

namespace {

constexpr std::uint32_t inputs = encoder::input_a | encoder::input_b | encoder::input_index;

std::int64_t floor_divided(std::int64_t value, std::int64_t by) noexcept {
    return value / by - (value % by < 0 ? 1 : 0);
}

/// The index pulse that the motion reaches first.
std::int64_t first_index(const QuadratureCounter::Motion& m) noexcept {
    if (m.to > m.from) return (floor_divided(m.from, m.index_every) + 1) * m.index_every;
    return floor_divided(m.from - 1, m.index_every) * m.index_every;
}

}  // namespace

/// Latches when the bit `arming` is set.
void QuadratureCounter::latch(std::uint16_t count, std::uint32_t arming) noexcept {
    if ((control_ & arming) == 0) return;
    latch_ = count;
    if ((control_ & encoder::just_once) != 0) {
        control_ &= ~arming;
    }
}

void QuadratureCounter::fail() noexcept { control_ |= encoder::quadrature_error; }

void QuadratureCounter::set_probe(bool level) noexcept {
    const bool wants_rising = (control_ & encoder::probe_polarity) != 0;
    const bool is_event = level != probe_ && level == wants_rising;
    probe_ = level;
    if (is_event) {
        latch(count_, encoder::latch_on_probe);
    }
}

void QuadratureCounter::meet_index(std::int64_t at, const Motion& motion) noexcept {
    const auto there = static_cast<std::uint16_t>(count_ + (at - motion.from));
    latch(there, encoder::latch_on_index);
    if ((control_ & encoder::clear_on_index) != 0) {
        count_ = static_cast<std::uint16_t>(count_ - there);
    }
}

void QuadratureCounter::move(const Motion& motion) noexcept {
    if (motion.to == motion.from) return;
    if (motion.index_every > 0) {
        const std::int64_t at = first_index(motion);
        if (std::clamp(at, std::min(motion.from, motion.to), std::max(motion.from, motion.to)) ==
            at) {
            meet_index(at, motion);
        }
        at_index_ = motion.to % motion.index_every == 0;
    }
    count_ = static_cast<std::uint16_t>(count_ + (motion.to - motion.from));
    last_edge_ = motion.last_edge;
    position_ = motion.to;
}

std::uint32_t QuadratureCounter::control_register() const noexcept {
    std::uint32_t value = control_ | std::uint32_t{latch_} << 16;
    value |= input_a() ? encoder::input_a : 0U;
    value |= input_b() ? encoder::input_b : 0U;
    value |= input_index() ? encoder::input_index : 0U;
    return value;
}

void QuadratureCounter::write_control(std::uint32_t value) noexcept {
    control_ = value & 0xffffU & ~inputs & ~encoder::quadrature_error;
}

}  // namespace hal::mesa
