// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>

#include "ethercat/plugins/channels/object_request.hpp"

namespace hal::ethercat {

/// An object that is not in the process data, as the input NAME. It is written by SDO when the pin
/// has another value than the slave. A pin that is 0 and not linked keeps what the slave has. With
/// the setting `per-unit`, the pin is a float of which 1.0 is that number in the object.
class ObjectPin final : public Channel {
public:
    explicit ObjectPin(const ChannelPlan& plan)
        : object_(plan),
          per_unit_(plan.channel.setting("per-unit", 0)),
          max_(std::exp2(plan.channel.setting("bits", 32)) - 1) {
        constexpr const char* about = "written by SDO when it changes";
        if (per_unit_ != 0.0) {
            scaled_.emplace(plan.component, plan.writes, plan.pin("").c_str(), about);
        } else if (plan.channel.setting("signed", 0) != 0) {
            signed_.emplace(plan.component, plan.writes, plan.pin("").c_str(), about);
        } else {
            unsigned_.emplace(plan.component, plan.writes, plan.pin("").c_str(), about);
        }
    }

    void write(const SlaveImage& image) noexcept override {
        object_.step(image);
        const std::int64_t value = requested();
        const bool linked = is_linked();
        used_ = used_ || linked || value != 0;
        if (used_ && object_.known() && value != object_.value()) {
            object_.write(image, value);
        }
    }
    void restart() noexcept override { object_.restart(); }

private:
    std::int64_t requested() const noexcept {
        if (scaled_) {
            const double raw = std::round(scaled_->get() * per_unit_);
            return std::isfinite(raw) ? static_cast<std::int64_t>(std::clamp(raw, 0.0, max_))
                                      : object_.value();
        }
        return signed_ ? std::int64_t{signed_->get()} : std::int64_t{unsigned_->get()};
    }
    bool is_linked() const noexcept {
        if (scaled_) return scaled_->linked();
        return signed_ ? signed_->linked() : unsigned_->linked();
    }

    ObjectRequest object_;
    double per_unit_ = 0.0;
    double max_ = 0.0;
    std::optional<In<double>> scaled_;
    std::optional<In<std::int32_t>> signed_;
    std::optional<In<std::uint32_t>> unsigned_;
    bool used_ = false;
};

}  // namespace hal::ethercat
