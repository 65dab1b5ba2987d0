// SPDX-License-Identifier: MIT
// The inputs and outputs of a device that takes several samples in a cycle, one at each pulse of
// SYNC0. An input is a value plus a sine, so that each sample has a known value at its own time.
#pragma once

#include <atomic>
#include <memory>
#include <string>
#include <vector>

#include "ethercat/devices/firmware.hpp"

namespace hal::ethercat::devices {

/// A value with samples, or a counter of cycles.
struct SampledEntry {
    std::uint8_t* data = nullptr;  ///< in the dictionary
    unsigned bits = 0;
    bool is_signed = false;
};

/// Everything is [realtime] unless marked.
class SampledIo : public Behaviour {
public:
    static constexpr std::size_t max_channels = 64;

    /// Counters are incremented once in a cycle of samples. [setup]
    SampledIo(std::shared_ptr<Dictionary>, std::vector<SampledEntry> inputs,
              std::vector<SampledEntry> outputs, std::vector<SampledEntry> counters);
    void power_on() noexcept override;
    void power_off() noexcept override;
    void step(Step&) noexcept override;

    std::size_t inputs() const noexcept { return inputs_.size(); }  ///< [any]
    std::size_t outputs() const noexcept { return outputs_.size(); }  ///< [any]
    /// Sets the value of an input: `offset` + `amplitude` sin(2 pi `frequency` t), t in system
    /// time. [any]
    void set_input(std::size_t channel, double offset, double amplitude, double frequency) noexcept;
    /// Returns the newest sample of an output. [any]
    std::int64_t output(std::size_t channel) const noexcept {
        return values_[channel].load(std::memory_order_relaxed);
    }
    /// Returns the samples taken since power-on, in OP if the device has outputs. [any]
    std::uint32_t samples() const noexcept { return samples_.load(std::memory_order_relaxed); }

private:
    struct Wave {
        std::atomic<double> offset{0};
        std::atomic<double> amplitude{0};
        std::atomic<double> frequency{0};
    };
    std::shared_ptr<Dictionary> dictionary_;  ///< which has the data of the entries
    std::vector<SampledEntry> inputs_, outputs_, counters_;
    std::array<Wave, max_channels> waves_;
    std::array<std::atomic<std::int64_t>, max_channels> values_{};
    std::atomic<std::uint32_t> samples_{0};
};

}  // namespace hal::ethercat::devices
