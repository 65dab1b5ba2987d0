// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>

#include "ethercat/plugins/channels/object_request.hpp"

namespace hal::ethercat {

/// A pulse train output in frequency mode, as the EL2521:
///
///     freq = velo-cmd * pos-scale        target = 32767 * freq / base frequency
///     counts += counted pulses           pos-fb = counts / pos-scale
///
/// The base frequency, the largest frequency and the ramps are read from the terminal; until then
/// the target is 0.
class FrequencyOutput final : public Channel {
public:
    explicit FrequencyOutput(const ChannelPlan& plan)
        : state_field_(plan.field("state")),
          count_field_(plan.field("count")),
          control_field_(plan.field("control")),
          target_field_(plan.field("target")),
          count_(plan.component, plan.reads, plan.pin("counts").c_str(), "counted pulses"),
          position_(plan.component, plan.reads, plan.pin("pos-fb").c_str(), "counted position"),
          ramp_active_(plan.component, plan.reads, plan.pin("ramp-active").c_str(),
                       "the frequency changes along a ramp"),
          ramp_disable_(plan.component, plan.writes, plan.pin("ramp-disable").c_str(),
                        "the frequency changes at once"),
          z_(plan, "in-z", "input Z"),
          t_(plan, "in-t", "input T"),
          enable_(plan.component, plan.writes, plan.pin("enable").c_str(), "enables the output"),
          command_(plan.component, plan.writes, plan.pin("velo-cmd").c_str(), "requested velocity"),
          frequency_(plan.component, plan.writes, plan.pin("freq").c_str(), "requested frequency",
                     {.unit = "Hz"}),
          max_velocity_(plan.component, plan.reads, plan.pin("maxvel").c_str(),
                        "velocity at the largest frequency"),
          max_fall_(plan.component, plan.reads, plan.pin("maxaccel-fall").c_str(),
                    "deceleration of the ramp"),
          max_rise_(plan.component, plan.reads, plan.pin("maxaccel-rise").c_str(),
                    "acceleration of the ramp"),
          scale_(plan.component, plan.reads, plan.pin("pos-scale").c_str(),
                 "pulses of one unit of the position", {.initial = 1.0}) {}

    void read(const SlaveImage& image) noexcept override {
        for (ObjectRequest* const object : {&base_, &max_, &rise_, &fall_, &factor_}) {
            object->step(image);
        }
        show_limits();
        const auto raw = static_cast<std::uint16_t>(count_field_.read(image));
        const auto counted = static_cast<std::int16_t>(static_cast<std::uint16_t>(raw - last_raw_));
        last_raw_ = raw;
        if (image.operational) {
            const auto state = static_cast<std::uint16_t>(state_field_.read(image));
            ramp_active_ = (state >> 1 & 1U) != 0;
            t_.show((state >> 4 & 1U) != 0);
            z_.show((state >> 5 & 1U) != 0);
            if (was_operational_) {
                count_ = static_cast<std::int32_t>(static_cast<std::uint32_t>(count_.get()) +
                                                   static_cast<std::uint32_t>(counted));
            }
            position_ = count_ / usable_scale(scale_);
        }
        was_operational_ = image.operational;
    }

    void write(const SlaveImage& image) noexcept override {
        control_field_.write(image, ramp_disable_ ? 2 : 0);
        const double wanted = enable_ ? command_ * usable_scale(scale_) : 0.0;
        frequency_ = std::isfinite(wanted) ? wanted : 0.0;
        const double raw = base_.known() && base_.value() > 0
                               ? frequency_ * full_scale / static_cast<double>(base_.value())
                               : 0.0;
        target_field_.write_limited(image, raw);
    }
    void restart() noexcept override {
        for (ObjectRequest* const object : {&base_, &max_, &rise_, &fall_, &factor_}) {
            object->restart();
        }
    }

private:
    static constexpr double full_scale = 0x7fff;

    /// An input and its inverse.
    struct Both {
        Both(const ChannelPlan& plan, const std::string& name, const char* doc)
            : pin(plan.component, plan.reads, plan.pin(name).c_str(), doc),
              inverted(plan.component, plan.reads, plan.pin(name + "-not").c_str(), doc) {}
        void show(bool on) noexcept {
            pin = on;
            inverted = !on;
        }
        Out<bool> pin;
        Out<bool> inverted;
    };

    void show_limits() noexcept {
        if (!base_.known() || !max_.known() || !rise_.known() || !fall_.known() ||
            !factor_.known()) {
            return;
        }
        const double scale = usable_scale(scale_);
        const auto base = static_cast<double>(base_.value());
        const auto max = static_cast<double>(max_.value());
        max_velocity_ = (max > 0 ? max * base / full_scale : base) / scale;
        // in steps of 10 Hz/s or 1 kHz/s
        const double step = (factor_.value() & 1) != 0 ? 1000.0 : 10.0;
        max_rise_ = step * static_cast<double>(rise_.value()) / scale;
        max_fall_ = step * static_cast<double>(fall_.value()) / scale;
    }

    ImageField state_field_, count_field_, control_field_, target_field_;
    Out<std::int32_t> count_;
    Out<double> position_;
    Out<bool> ramp_active_;
    In<bool> ramp_disable_;
    Both z_, t_;
    In<bool> enable_;
    In<double> command_;
    Out<double> frequency_, max_velocity_, max_fall_, max_rise_;
    Param<double> scale_;
    ObjectRequest base_{0x8001, 2, 32, false};     ///< base frequency in Hz
    ObjectRequest rise_{0x8001, 4, 16, false};     ///< ramp, rising
    ObjectRequest fall_{0x8001, 5, 16, false};     ///< ramp, falling
    ObjectRequest factor_{0x8000, 7, 8, false};    ///< unit of the ramps
    ObjectRequest max_{0x8800, 2, 16, false};  ///< largest value of the target, or 0
    std::uint16_t last_raw_ = 0;
    bool was_operational_ = false;
};

}  // namespace hal::ethercat
