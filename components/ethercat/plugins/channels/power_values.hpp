// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>

#include "ethercat/plugins/channels/channel.hpp"

namespace hal::ethercat {

/// The values that a power measurement terminal, as the EL3403, sends one after the other:
/// `request` selects one of six, and `selector` is the number of the value in `val`.
class PowerValues final : public Channel {
public:
    explicit PowerValues(const ChannelPlan& plan)
        : request_field_(plan.field("request")),
          selector_field_(plan.field("selector")),
          value_field_(plan.field("val")),
          values_{{{plan, "apparent-power", "apparent power"},
                   {plan, "reactive-power", "reactive power"},
                   {plan, "energy", "energy"},
                   {plan, "cosphi", "power factor"},
                   {plan, "frequency", "frequency"},
                   {plan, "energy-negative", "energy fed back"}}} {}

    void read(const SlaveImage& image) noexcept override {
        const std::uint64_t selected = selector_field_.read(image);
        if (!image.operational || selected >= values_.size()) return;
        values_[selected].pin =
            static_cast<double>(value_field_.read_signed(image)) * factors[selected];
        if (selected == requested_) {
            requested_ = (requested_ + 1) % values_.size();
        }
    }
    void write(const SlaveImage& image) noexcept override {
        request_field_.write(image, requested_);
    }

private:
    static constexpr std::size_t count = 6;
    static constexpr double factors[count] = {0.01, 0.01, 0.001, 0.001, 0.1, 0.001};
    struct Value {
        Value(const ChannelPlan& plan, const char* suffix, const char* doc)
            : pin(plan.component, plan.reads, plan.pin(suffix).c_str(), doc) {}
        Out<double> pin;
    };

    ImageField request_field_, selector_field_, value_field_;
    std::array<Value, count> values_;
    std::uint64_t requested_ = 0;
};

}  // namespace hal::ethercat
