// SPDX-License-Identifier: MIT
// The master of a demo bus.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "demo_bus/config/demo_config.hpp"
#include "demo_bus/station/station_events.hpp"
#include "demo_bus/wire/frames.hpp"
#include "link/can.hpp"

namespace hal::demo {

class Station {
public:
    /// Both outlive it. [setup]
    Station(const Bus& bus, Events& events);
    /// The link outlives the use of it. [setup]
    void attach(can::Link& link) noexcept { link_ = &link; }
    void detach() noexcept { link_ = nullptr; }

    /// Begins anew: all devices are offline until they send a value. [realtime]
    void restart() noexcept;
    /// [realtime]
    void receive(std::int64_t now_ns) noexcept;
    /// Sends all set-points. [realtime]
    void transmit(std::int64_t now_ns) noexcept;

    bool is_online(std::size_t device) const noexcept { return devices_[device].is_online; }
    double value(std::size_t device) const noexcept { return devices_[device].value; }
    void set(std::size_t device, double set_point) noexcept {
        devices_[device].set_point = set_point;
    }

private:
    struct DeviceState {
        double value = 0.0;
        double set_point = 0.0;
        std::int64_t heard_ns = 0;
        bool is_online = false;
    };
    static constexpr std::size_t unknown = SIZE_MAX;

    const Bus& bus_;
    Events& events_;
    can::Link* link_ = nullptr;
    std::vector<DeviceState> devices_;
    std::array<std::size_t, max_address + 1> device_at_;  ///< by address
};

}  // namespace hal::demo
