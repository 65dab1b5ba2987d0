// SPDX-License-Identifier: MIT
// The pins of one device.
#pragma once

#include <cmath>
#include <cstddef>

#include "demo_bus/station/station.hpp"
#include "hal/component.hpp"

namespace hal::demo {

class DevicePins {
public:
    /// `number`: the index of the device in the configuration. [setup]
    DevicePins(hal::Component& c, const hal::Function& receive, const hal::Function& transmit,
               const Device& device, std::size_t number)
        : number_(number),
          online_(c, receive, (device.name + ".online").c_str(), "the device sends its value",
                  {.safe = false}),
          value_(c, receive, (device.name + ".value").c_str(), "its value"),
          set_point_(c, transmit, (device.name + ".set-point").c_str(), "what is sent to it") {}

    /// [realtime] receive
    void show(const Station& station) noexcept {
        online_ = station.is_online(number_);
        value_ = station.value(number_);
    }
    /// NaN and infinity keep the last set-point. Returns whether it is one. [realtime] transmit
    bool transmit(Station& station) const noexcept {
        const double set_point = set_point_;
        if (!std::isfinite(set_point)) return true;
        station.set(number_, set_point);
        return false;
    }

private:
    const std::size_t number_;
    hal::Out<bool> online_;
    hal::Out<double> value_;
    hal::In<double> set_point_;
};

}  // namespace hal::demo
