// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <optional>

#include "ethercat/plugins/channels/channel.hpp"

namespace hal::ethercat {

/// An analog input with its state:
///
///     val = raw / 32767 * scale + bias
///
/// With the setting `temperature` it is named NAME-temperature, and is raw * scale. The objects
/// `status` (a byte) and `under`, `over`, `error`, `sync` (bits) are the state.
class AnalogInput final : public Channel {
public:
    explicit AnalogInput(const ChannelPlan& plan)
        : temperature_(plan.channel.setting("temperature", 0) != 0),
          is_unsigned_(plan.channel.setting("unsigned", 0) != 0),
          raw_(plan.component, plan.reads, plan.pin("raw").c_str(), "value of the slave"),
          value_(plan.component, plan.reads, plan.pin(value_name(plan)).c_str(), "scaled value"),
          scale_(plan.component, plan.reads, plan.pin("scale").c_str(),
                 temperature_ ? "temperature of one step" : "value at full scale",
                 {.initial = plan.channel.setting("scale", temperature_ ? 0.1 : 1.0)}),
          field_(plan.field("val")) {
        if (!temperature_) {
            bias_.emplace(plan.component, plan.reads, plan.pin("bias").c_str(),
                          "is added to the value");
        }
        add_flag(plan, sync_, "sync", "sync-err", "the value is not synchronous");
        add_flag(plan, error_, "error", "error", "the channel has an error");
        add_flag(plan, over_, "over", "overrange", "the value is above the range");
        add_flag(plan, under_, "under", "underrange", "the value is below the range");
    }

    void read(const SlaveImage& image) noexcept override {
        if (!image.operational) return;
        show(sync_, image);
        show(error_, image);
        show(over_, image);
        show(under_, image);
        const auto raw = is_unsigned_ ? static_cast<std::int64_t>(field_.read(image))
                                      : field_.read_signed(image);
        raw_ = static_cast<std::int32_t>(raw);
        const double scaled = static_cast<double>(raw) * scale_.get();
        value_ = temperature_ ? scaled : scaled / full_scale + bias_->get();
    }

private:
    static constexpr double full_scale = 32767.0;
    struct Flag {
        Flag(const ChannelPlan& plan, ImageField from, const char* suffix, const char* doc)
            : field(from), pin(plan.component, plan.reads, plan.pin(suffix).c_str(), doc) {}
        ImageField field;
        Out<bool> pin;
    };

    static std::string value_name(const ChannelPlan& plan) {
        if (plan.channel.setting("temperature", 0) != 0) return "temperature";
        if (plan.channel.setting("pressure", 0) != 0) return "pressure";
        return "val";
    }
    static void add_flag(const ChannelPlan& plan, std::unique_ptr<Flag>& flag, const char* role,
                         const char* suffix, const char* doc) {
        if (const ImageField field = plan.field(role); field.present()) {
            flag = std::make_unique<Flag>(plan, field, suffix, doc);
        }
    }
    static void show(const std::unique_ptr<Flag>& flag, const SlaveImage& image) noexcept {
        if (flag) {
            flag->pin = flag->field.read_bit(image);
        }
    }

    const bool temperature_;
    const bool is_unsigned_;
    Out<std::int32_t> raw_;
    Out<double> value_;
    Io<double> scale_;
    std::optional<Io<double>> bias_;
    ImageField field_;
    std::unique_ptr<Flag> sync_, error_, over_, under_;
};

}  // namespace hal::ethercat
