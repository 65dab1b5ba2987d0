// SPDX-License-Identifier: MIT
#include "demo_bus/station/station.hpp"

namespace hal::demo {

Station::Station(const Bus& bus, Events& events)
    : bus_(bus), events_(events), devices_(bus.devices.size()) {
    device_at_.fill(unknown);
    for (std::size_t n = 0; n < bus.devices.size(); ++n) {
        device_at_[bus.devices[n].address] = n;
    }
}

void Station::restart() noexcept {
    link_->discard_queued();
    for (DeviceState& device : devices_) {
        device.is_online = false;
    }
}

void Station::receive(std::int64_t now_ns) noexcept {
    for (can::Frame frame; link_->receive(frame, now_ns);) {
        const std::size_t n = device_at_[sender_of(frame)];
        if (n == unknown) continue;
        DeviceState& device = devices_[n];
        device.value = counts_of(frame) * bus_.devices[n].scale;
        device.heard_ns = now_ns;
        if (device.is_online) continue;
        device.is_online = true;
        events_.on_event(Event::device_online, static_cast<std::uint32_t>(n), 0);
    }
    for (std::size_t n = 0; n < devices_.size(); ++n) {
        DeviceState& device = devices_[n];
        const std::int64_t silence_ns = now_ns - device.heard_ns;
        if (!device.is_online || silence_ns <= bus_.silence_ns) continue;
        device.is_online = false;
        events_.on_event(Event::device_offline, static_cast<std::uint32_t>(n), silence_ns);
    }
}

void Station::transmit(std::int64_t now_ns) noexcept {
    for (std::size_t n = 0; n < devices_.size(); ++n) {
        const Device& device = bus_.devices[n];
        link_->send(set_point_frame(device.address, devices_[n].set_point / device.scale), now_ns);
    }
    link_->flush(now_ns);
}

}  // namespace hal::demo
