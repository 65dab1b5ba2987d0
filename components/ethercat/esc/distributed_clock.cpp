// SPDX-License-Identifier: MIT
#include "ethercat/esc/distributed_clock.hpp"

#include <algorithm>
#include <cmath>

#include "ethercat/wire/byte_order.hpp"
#include "ethercat/wire/registers.hpp"

namespace hal::ethercat::esc {

namespace dc_registers {
constexpr std::uint16_t activation_status = 0x0984;
constexpr std::uint16_t latch_control = 0x09a8;
constexpr std::uint16_t latch_status = 0x09ae;

constexpr std::uint16_t latch_times = 0x09b0;
constexpr std::uint32_t sync0_event = 0x4;
constexpr std::uint32_t sync1_event = 0x8;
}  // namespace dc_registers

void DistributedClock::reset(std::int64_t now_ns, std::int64_t local_ns) noexcept {
    clock_.reset(now_ns, local_ns);
    latched_frame_ = 0;
    seen_ = {};
    last_step_ns_ = INT64_MIN;
    filtered_ = speed_ = 0;
    sync_ = {};
    sync0_on_ = sync1_on_ = false;
    sync0_dc_ = sync1_dc_ = next_ns_ = INT64_MAX;
}

void DistributedClock::arrive(unsigned port, std::int64_t now_ns, std::uint64_t number) noexcept {
    seen_[port] = {number, now_ns};
    if (number == latched_frame_) {
        put(memory_ + registers::dc_receive_time + 4 * port,
            static_cast<std::uint32_t>(clock_.at(now_ns)));
    }
}

void DistributedClock::latch_receive_times(std::int64_t unit_ns, std::uint64_t number) noexcept {
    if (!present_) return;
    latched_frame_ = number;
    for (unsigned port = 0; port < seen_.size(); ++port) {
        if (seen_[port].number == number) {
            put(memory_ + registers::dc_receive_time + 4 * port,
                static_cast<std::uint32_t>(clock_.at(seen_[port].time_ns)));
        }
    }
    const auto unit = static_cast<std::uint64_t>(clock_.at(unit_ns));
    put(memory_ + registers::dc_receive_time_unit, wide_ ? unit : unit & 0xffff'ffffU);
}

std::int64_t DistributedClock::system_time(std::int64_t now_ns) const noexcept {
    const auto local = static_cast<std::uint64_t>(clock_.at(now_ns));
    return static_cast<std::int64_t>(
        local + get<std::uint64_t>(memory_ + registers::dc_system_time_offset));
}

void DistributedClock::show_system_time(std::int64_t now_ns) noexcept {
    if (!present_) return;
    const auto time = static_cast<std::uint64_t>(system_time(now_ns)) -
                      get<std::uint32_t>(memory_ + registers::dc_system_time_delay);
    put(memory_ + registers::dc_system_time, wide_ ? time : time & 0xffff'ffffU);
}

/// A PI controller of the clock's speed. Each step sees the error e = local copy - delay -
/// received:
///   speed -= e / (256 interval);  correction = speed - e / (8 interval), both limited to 1 / (0930h).
/// The limit is the controller's means: one tick of 10 ns more or less in 0930h ticks.
void DistributedClock::receive_system_time(std::uint64_t received, std::size_t bytes,
                                           std::int64_t now_ns) noexcept {
    if (!present_ || bytes < 4) return;
    const auto delayed = static_cast<std::uint64_t>(system_time(now_ns)) -
                         get<std::uint32_t>(memory_ + registers::dc_system_time_delay);
    const auto difference = wide_ && bytes >= 8
                                ? static_cast<std::int64_t>(delayed - received)
                                : std::int64_t{static_cast<std::int32_t>(
                                      static_cast<std::uint32_t>(delayed - received))};
    const unsigned depth = std::min(memory_[registers::dc_filter_depth] & 0x0fU, 12U);
    const auto error = static_cast<double>(difference);
    filtered_ += (error - filtered_) / static_cast<double>(1U << depth);
    const auto magnitude =
        static_cast<std::uint32_t>(std::min(std::abs(std::round(filtered_)), 2147483647.0));
    put(memory_ + registers::dc_system_time_difference,
        magnitude | (filtered_ < 0 ? 0x8000'0000U : 0U));

    const std::int64_t local = clock_.at(now_ns);

    const std::int64_t interval = last_step_ns_ == INT64_MIN ? 0 : local - last_step_ns_;
    last_step_ns_ = local;
    if (interval <= 0 || interval > 1'000'000'000) return;
    const double limit =
        1.0 /
        std::max<double>(get<std::uint16_t>(memory_ + registers::dc_speed_counter_start), 64.0);
    const double relative = error / static_cast<double>(interval);
    const double proportional = speed_ - relative / 8;
    const double correction = std::clamp(proportional, -limit, limit);
    // not while limited
    if (correction == proportional) {
        speed_ = std::clamp(speed_ - relative / 256, -limit, limit);
    } else {
        speed_ += (correction - speed_) / 64;
    }
    if (correction == clock_.correction()) return;  // a clock that runs right
    clock_.set_correction(correction, now_ns);
    find_next();
}

void DistributedClock::clear_filters(std::int64_t now_ns) noexcept {
    filtered_ = 0;
    put(memory_ + registers::dc_system_time_difference, std::uint32_t{0});
    speed_ = 0;
    last_step_ns_ = INT64_MIN;
    clock_.set_correction(0, now_ns);
    clock_changed(now_ns);
}

void DistributedClock::clock_changed(std::int64_t now_ns) noexcept {
    if (!sync0_on_) return;
    const std::int64_t time = system_time(now_ns);
    const std::int64_t cycle = sync_.sync0_cycle_ns;
    const auto behind = [&](std::int64_t pulse) {
        return static_cast<std::int64_t>(static_cast<std::uint64_t>(time) -
                                         static_cast<std::uint64_t>(pulse));
    };
    // after a jump
    const bool skips = cycle > 0 && sync0_dc_ != INT64_MAX && behind(sync0_dc_) > cycle;
    if (skips) {
        sync0_dc_ += behind(sync0_dc_) / cycle * cycle;
    }
    if (sync1_on_ && sync1_dc_ != INT64_MAX && behind(sync1_dc_) > cycle) {
        sync1_dc_ = INT64_MAX;
    }
    find_next();
}

void DistributedClock::activate(std::int64_t now_ns) noexcept {
    if (!present_) return;
    const std::uint8_t activation = memory_[registers::dc_activation];
    constexpr std::uint32_t shortest_cycle_ns = 10'000;
    sync_.sync0_cycle_ns = get<std::uint32_t>(memory_ + registers::dc_sync0_cycle);
    if (sync_.sync0_cycle_ns != 0) {
        sync_.sync0_cycle_ns = std::max(sync_.sync0_cycle_ns, shortest_cycle_ns);
    }
    sync_.sync1_cycle_ns = get<std::uint32_t>(memory_ + registers::dc_sync1_cycle);
    const bool on = (activation & 0x03) == 0x03;
    if (on == sync0_on_) return;
    sync0_on_ = sync_.active = on;
    sync1_on_ = sync_.sync1_active = on && (activation & 0x04) != 0;
    sync0_dc_ = sync1_dc_ = INT64_MAX;
    memory_[dc_registers::activation_status] = 0;
    if (on) {
        const std::int64_t time = system_time(now_ns);
        auto start = get<std::int64_t>(memory_ + registers::dc_start_time);
        const bool extend = !wide_ || (activation & 0x10) != 0;
        if (extend) {
            start = time + static_cast<std::uint32_t>(static_cast<std::uint32_t>(start) -
                                                      static_cast<std::uint32_t>(time));
        }
        if (start < time) {
            // in the past: no pulse, as if the start waited for the wrap of 64 bits
            memory_[dc_registers::activation_status] = 0x04;
        } else {
            sync0_dc_ = start;
            memory_[dc_registers::activation_status] = sync1_on_ ? 0x03 : 0x01;
        }
    }
    find_next();
}

void DistributedClock::find_next() noexcept {
    const std::int64_t next = std::min(sync0_dc_, sync1_dc_);
    const auto local = static_cast<std::uint64_t>(next) -
                       get<std::uint64_t>(memory_ + registers::dc_system_time_offset);
    next_ns_ = next == INT64_MAX ? INT64_MAX : clock_.time_of(static_cast<std::int64_t>(local));
}

std::uint32_t DistributedClock::pulse() noexcept {
    std::uint32_t events = 0;
    if (sync0_dc_ <= sync1_dc_) {
        const std::int64_t cycle = sync_.sync0_cycle_ns;
        ++sync_.pulses;
        sync_.last_pulse_ns = next_ns_;
        sync_.last_pulse_dc_ns = static_cast<std::uint64_t>(sync0_dc_);
        memory_[dc_registers::activation_status] &= 0xfe;
        memory_[registers::dc_sync0_status] |= 1;
        if (sync1_on_ && sync1_dc_ == INT64_MAX) {
            sync1_dc_ = sync0_dc_ + sync_.sync1_cycle_ns;
        }
        sync0_dc_ = cycle > 0 ? sync0_dc_ + cycle : INT64_MAX;
        events |= dc_registers::sync0_event;
        if (sync1_on_ && sync_.sync1_cycle_ns == 0) {  // together with SYNC0
            sync1_dc_ = INT64_MAX;
            events |= dc_registers::sync1_event;
        }
    } else {
        sync1_dc_ = INT64_MAX;  // the next SYNC0 pulse starts it again
        events |= dc_registers::sync1_event;
    }
    if ((events & dc_registers::sync1_event) != 0) {
        ++sync_.sync1_pulses;
        memory_[registers::dc_sync0_status + 1] |= 1;
        memory_[dc_registers::activation_status] &= 0xfd;
    }
    find_next();
    return events;
}

void DistributedClock::latch(unsigned input, bool rising, std::int64_t now_ns) noexcept {
    if (!present_ || input > 1) return;
    const std::uint8_t edge = rising ? 1 : 2;
    std::uint8_t& status = memory_[dc_registers::latch_status + input];
    const bool single = (memory_[dc_registers::latch_control + input] & edge) != 0;
    if (single && (status & edge) != 0) return;
    status |= edge;
    put(memory_ + dc_registers::latch_times + 16 * input + (rising ? 0 : 8), system_time(now_ns));
}

void DistributedClock::was_read(std::uint16_t address, std::size_t length) noexcept {
    const auto covers = [&](unsigned at) { return address <= at && at < address + length; };
    for (unsigned input = 0; input < 2; ++input) {
        if (covers(registers::dc_sync0_status + input) &&
            get<std::uint16_t>(memory_ + registers::dc_pulse_length) == 0) {
            memory_[registers::dc_sync0_status + input] = 0;
        }
        // of the PDI
        if ((memory_[registers::dc_cyclic_unit_control] & (0x10 << input)) != 0) continue;
        for (unsigned edge = 0; edge < 2; ++edge) {
            if (covers(dc_registers::latch_times + 16 * input + 8 * edge)) {
                memory_[dc_registers::latch_status + input] &=
                    static_cast<std::uint8_t>(~(1U << edge));
            }
        }
    }
}

}  // namespace hal::ethercat::esc
