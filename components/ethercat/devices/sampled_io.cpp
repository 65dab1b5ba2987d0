// SPDX-License-Identifier: MIT
#include "ethercat/devices/sampled_io.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "cia301/values.hpp"

namespace hal::ethercat::devices {

namespace {

std::uint64_t read(const SampledEntry& entry) noexcept {
    std::uint64_t value = 0;
    std::memcpy(&value, entry.data, (entry.bits + 7) / 8);
    return value;
}

void write(const SampledEntry& entry, std::uint64_t value) noexcept {
    if (entry.bits < 64) {
        value &= (std::uint64_t{1} << entry.bits) - 1;
    }
    std::memcpy(entry.data, &value, (entry.bits + 7) / 8);
}

/// Returns a value with the sign of its highest bit.
std::int64_t extended(const SampledEntry& entry) noexcept {
    const std::uint64_t value = read(entry);
    if (!entry.is_signed) return static_cast<std::int64_t>(value);
    return cia301::sign_extended(value, entry.bits);
}

/// Returns the count of a value, limited to the range of the entry. A bit is set above 0.
std::int64_t limited(const SampledEntry& entry, double value) noexcept {
    if (entry.bits == 1) return value > 0 ? 1 : 0;
    const int bits = static_cast<int>(std::min(entry.bits, 53U));
    const double top = std::ldexp(1.0, entry.is_signed ? bits - 1 : bits) - 1;
    const double bottom = entry.is_signed ? -top - 1 : 0.0;
    return std::llround(std::clamp(value, bottom, top));
}

}  // namespace

SampledIo::SampledIo(std::shared_ptr<Dictionary> dictionary, std::vector<SampledEntry> inputs,
                     std::vector<SampledEntry> outputs, std::vector<SampledEntry> counters)
    : dictionary_(std::move(dictionary)),
      inputs_(std::move(inputs)),
      outputs_(std::move(outputs)),
      counters_(std::move(counters)) {
    inputs_.resize(std::min(inputs_.size(), max_channels));
    outputs_.resize(std::min(outputs_.size(), max_channels));
}

void SampledIo::power_on() noexcept {
    samples_.store(0, std::memory_order_relaxed);
    for (auto& value : values_) {
        value.store(0, std::memory_order_relaxed);
    }
}

void SampledIo::power_off() noexcept {
    for (auto& value : values_) {
        value.store(0, std::memory_order_relaxed);
    }
}

void SampledIo::set_input(std::size_t channel, double offset, double amplitude,
                          double frequency) noexcept {
    Wave& wave = waves_[channel];
    wave.offset.store(std::isfinite(offset) ? offset : 0, std::memory_order_relaxed);
    wave.amplitude.store(std::isfinite(amplitude) ? amplitude : 0, std::memory_order_relaxed);
    wave.frequency.store(std::isfinite(frequency) ? frequency : 0, std::memory_order_relaxed);
}

void SampledIo::step(Step& s) noexcept {
    const double now_s = static_cast<double>(s.sync_time_ns) * 1e-9;
    for (std::size_t n = 0; n < inputs_.size(); ++n) {
        const Wave& wave = waves_[n];
        // whole periods are taken off first, so that the phase keeps its digits
        const double periods = std::fmod(wave.frequency.load(std::memory_order_relaxed) * now_s, 1);
        const double value = wave.offset.load(std::memory_order_relaxed) +
                             wave.amplitude.load(std::memory_order_relaxed) *
                                 std::sin(2 * std::numbers::pi * periods);
        write(inputs_[n], static_cast<std::uint64_t>(limited(inputs_[n], value)));
    }
    for (std::size_t n = 0; n < outputs_.size(); ++n) {
        values_[n].store(s.outputs_valid ? extended(outputs_[n]) : 0, std::memory_order_relaxed);
    }
    if (s.sync_cycle_ns == 0) return;
    if (s.sample == 0) {
        for (const SampledEntry& counter : counters_) {
            write(counter, read(counter) + 1);
        }
    }
    if (outputs_.empty() || s.outputs_valid) {
        samples_.fetch_add(1, std::memory_order_relaxed);
    }
}

}  // namespace hal::ethercat::devices
