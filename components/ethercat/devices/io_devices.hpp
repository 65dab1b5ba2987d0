// SPDX-License-Identifier: MIT
// Digital and analog inputs and outputs without moving parts.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "ethercat/devices/builder.hpp"
#include "ethercat/devices/device_options.hpp"

namespace hal::ethercat::devices {

inline constexpr unsigned max_channels = 64;

/// Terminal values of an I/O device. Inputs are written from any thread and outputs read from any
/// thread.
class IoBehaviour : public Behaviour {
public:
    /// `index` is the first channel's object, at `index` + 10h * n sub 1, or, for bits, sub n + 1.
    /// [setup]
    IoBehaviour(std::shared_ptr<Dictionary>, std::uint16_t index, unsigned channels, bool output,
                bool digital);
    void step(Step&) noexcept override;
    void power_on() noexcept override;
    void power_off() noexcept override { power_on(); }
    void set_input(unsigned channel, std::int32_t value) noexcept {
        values_[channel % max_channels].store(value, std::memory_order_relaxed);
    }
    std::int32_t output(unsigned channel) const noexcept {
        return values_[channel % max_channels].load(std::memory_order_relaxed);
    }
    unsigned channels() const noexcept { return channels_; }

private:
    std::shared_ptr<Dictionary> dictionary_;
    std::array<std::uint8_t*, max_channels> data_{};
    std::array<std::atomic<std::int32_t>, max_channels> values_{};
    unsigned channels_;
    bool output_, digital_;
};

/// A coupler: neither mailbox nor process data.
class Idle : public Behaviour {
public:
    void step(Step&) noexcept override {}
};

/// A device: its description and its behaviour.
struct Parts {
    Design design;
    std::unique_ptr<Behaviour> behaviour;
};
Parts make_coupler(const DeviceOptions&);  ///< [setup]
Parts make_digital(const DeviceOptions&, bool output);  ///< `bits` 1..64. [setup]
Parts make_analog(const DeviceOptions&, bool output);  ///< `channels` 1..16. [setup]

}  // namespace hal::ethercat::devices
