// SPDX-License-Identifier: MIT
// The analogue-input function block of CiA 404, for up to 32 channels: sub-index n of each object
// is channel n.
//
//     field value 6100h -> process value 6130h = field · factor + scaling offset + offset -> net value 6140h = process - tare
//
// Each value has four objects: 61xxh REAL32, 71xxh INTEGER16, 81xxh INTEGER24, 91xxh INTEGER32. The
// integers are the real value times 10^digits (6132h), clamped to their type; a write to one of the
// four changes all.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "canopen/protocol/device.hpp"

namespace hal::canopen {

/// Initial values of a channel at power-on.
struct AnalogChannel {
    const char* name = "";
    std::uint16_t sensor_type = 0;  ///< 6110h
    std::uint32_t unit = 0;  ///< 6131h, coded as in CiA 303-2; 0: not specified
    std::uint8_t digits = 0;  ///< 6132h, 0..6
};

/// Adds objects 6100h to 6150h and those of the families 71xxh, 81xxh and 91xxh. [setup]
void add_analog_inputs(Description&, std::span<const AnalogChannel>);

/// Implements the objects. Channels `n` are counted from 0.
class AnalogInputs final : public Handler {
public:
    // bits of 6150h
    static constexpr std::uint8_t not_valid = 0x01;
    static constexpr std::uint8_t too_high = 0x02;
    static constexpr std::uint8_t too_low = 0x04;

    /// Binds the values of `channels` channels, as many as were described. [setup]
    void attach(Device&, unsigned channels);
    /// Resets the application: forgets the values sent before. [realtime]
    void reset() noexcept;

    /// Processes a new field value; `counts` is the raw reading of the converter. Ignored for a
    /// channel that is off (6112h = 0) or whose sample is not due (6114h). [realtime]
    void sample(unsigned n, double field, std::int32_t counts, std::uint8_t status,
                Time now) noexcept;
    /// Returns true when the process value has moved by more than its delta (6133h), or passed a
    /// limit (6134h, 6135h), since it was last sent. [realtime]
    bool changed(unsigned n) const noexcept { return channels_[n].changed; }
    /// Marks the process value as sent. [realtime]
    void mark_sent(unsigned n) noexcept;

    double field(unsigned n) const noexcept { return channels_[n].field; }
    double process(unsigned n) const noexcept;
    double net(unsigned n) const noexcept { return process(n) - double{channels_[n].tare}; }

    Abort reading(Entry&) noexcept override;
    Abort writing(Entry&, std::span<const std::uint8_t>) noexcept override;
    void written(Entry&) noexcept override;

private:
    struct Channel {
        float fv1 = 0;
        float pv1 = 0;
        float fv2 = 1;
        float pv2 = 1;
        float offset = 0;
        float factor = 1;
        float scaling_offset = 0;

        float delta = 0;
        float lower = 0;
        float upper = 0;
        float tare = 0;
        float process = 0;
        float field_shown = 0;
        float net_shown = 0;
        std::uint32_t period_us = 0;
        std::uint8_t digits = 0;
        std::uint8_t mode = 1;
        std::uint8_t status = 0;
        double field = 0;
        double sent = 0;
        std::int32_t counts = 0;
        std::int8_t zone = 0;
        std::int8_t sent_zone = 0;  // below the lower limit, between, above the upper one
        bool changed = false;
        bool sampled = false;
        Time last = 0;
    };
    float* value(Channel&, std::uint8_t part) noexcept;
    double displayed(unsigned n, std::uint8_t part) noexcept;
    void show(unsigned n) noexcept;

    std::vector<Channel> channels_;
};

}  // namespace hal::canopen
