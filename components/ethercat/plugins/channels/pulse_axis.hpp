// SPDX-License-Identifier: MIT
#pragma once

#include <cstdlib>
#include <limits>

#include "ethercat/plugins/channels/channel.hpp"

namespace hal::ethercat {

/// An axis of a controller that makes pulses of a frequency and counts 16 bits, as the EpoCAT:
///
///     hz      = dac-value * 1000 / enc-scale * dac-scale        enc-pos = raw-count * enc-scale
///
/// index-enable makes the position 0 when the controller has seen the index; `update-position`
/// makes it set-position at its rising edge.
class PulseAxis final : public Channel {
public:
    explicit PulseAxis(const ChannelPlan& plan)
        : count_field_(plan.field("count")),
          flag_field_(plan.field("flag")),
          frequency_field_(plan.field("frequency")),
          direction_field_(plan.field("direction")),
          hold_field_(plan.field("hold")),
          select_field_(plan.field("select")),
          hz_(plan.component, plan.writes, plan.pin("hz").c_str(), "pulses in a second",
              {.unit = "Hz"}),
          position_(plan.component, plan.reads, plan.pin("enc-pos").c_str(), "counted position"),
          count_(plan.component, plan.reads, plan.pin("raw-count").c_str(), "counted steps"),
          index_enable_(plan.component, plan.reads, plan.pin("index-enable").c_str(),
                        "makes the position 0 at the next index; FALSE again afterwards"),
          value_(plan.component, plan.writes, plan.pin("dac-value").c_str(), "requested velocity"),
          encoder_scale_(plan.component, plan.reads, plan.pin("enc-scale").c_str(),
                         "position of one step", {.initial = 1.0}),
          value_scale_(plan.component, plan.writes, plan.pin("dac-scale").c_str(),
                       "factor of the velocity", {.initial = 1.0}),
          set_position_(plan.component, plan.reads, plan.pin("set-position").c_str(),
                        "position of update-position"),
          update_position_(plan.component, plan.reads, plan.pin("update-position").c_str(),
                           "makes the position set-position when it becomes TRUE") {}

    void read(const SlaveImage& image) noexcept override {
        if (!image.operational) return;
        const double scale = usable_scale(encoder_scale_);
        if (flag_field_.read_bit(image)) {
            index_enable_ = false;
            total_ = 0;
        }
        if (update_position_ && !was_updated_) {
            set_total(set_position_ / scale);
        }
        was_updated_ = update_position_;
        const auto raw = static_cast<std::uint16_t>(count_field_.read(image));
        total_ += static_cast<std::uint32_t>(
            std::int32_t{static_cast<std::int16_t>(static_cast<std::uint16_t>(raw - last_))});
        last_ = raw;
        count_ = static_cast<std::int32_t>(total_);
        position_ = static_cast<double>(count_.get()) * scale;
    }

    void write(const SlaveImage& image) noexcept override {
        select_field_.write(image, 1);  // the index, not the probe
        hold_field_.write(image, index_enable_ ? 0 : 1);
        const double hz = value_ * 1000.0 / usable_scale(encoder_scale_) * value_scale_;
        if (!std::isfinite(hz)) return;  // the last value stays
        constexpr double limit = std::numeric_limits<std::int32_t>::max();
        const double magnitude = std::fmin(std::fabs(hz), limit);
        hz_ = static_cast<std::int32_t>(magnitude);
        frequency_field_.write(image, static_cast<std::uint64_t>(magnitude));
        direction_field_.write(image, hz < 0 ? 1 : 0);
    }

private:
    void set_total(double steps) noexcept {
        constexpr double limit = std::numeric_limits<std::int32_t>::max();
        if (std::isfinite(steps)) {
            total_ = static_cast<std::uint32_t>(
                static_cast<std::int32_t>(std::fmax(std::fmin(steps, limit), -limit)));
        }
    }

    ImageField count_field_, flag_field_, frequency_field_, direction_field_, hold_field_;
    ImageField select_field_;
    Out<std::int32_t> hz_;
    Out<double> position_;
    Out<std::int32_t> count_;
    Io<bool> index_enable_;
    In<double> value_;
    Param<double> encoder_scale_, value_scale_, set_position_;
    Param<bool> update_position_;
    std::uint32_t total_ = 0;  // wraps as raw-count does
    std::uint16_t last_ = 0;
    bool was_updated_ = false;
};

}  // namespace hal::ethercat
