// SPDX-License-Identifier: MIT
// The events of a demo bus: the lines that are printed, and the texts of those that are faults.
#pragma once

#include <cstdint>
#include <cstdio>
#include <string>
#include <string_view>

#include "bus/events/event_rows.hpp"
#include "demo_bus/config/demo_config.hpp"
#include "demo_bus/station/station_events.hpp"
#include "hal/message_log.hpp"

namespace hal::demo {

/// An event on its way from the cycle to the thread that prints it.
struct EventRecord {
    Event event;
    std::uint32_t device;
    std::int64_t silence_ns;
};

inline constexpr bus::EventRow<Event> event_rows[] = {
    {Event::device_online, bus::Effect::ends, "{device} is online"},
    {Event::device_offline, bus::Effect::raises,
     "{device} is offline: no value for {s}[; check its power and wiring]"},
};
static_assert(bus::in_order(event_rows));

class EventTexts {
public:
    /// The bus outlives it. [setup]
    explicit EventTexts(const Bus& bus)
        : bus_(bus),
          faults_(event_rows, bus.devices.size(),
                  [this](Event, std::size_t device, std::string_view) { return text_of(device); }) {
    }

    /// [setup]
    std::string line(const EventRecord& record) const {
        const auto value_of = [&](std::string_view name) {
            return name == "s" ? seconds(record.silence_ns) : text_of(record.device);
        };
        return bus::format(event_rows[static_cast<std::size_t>(record.event)].text, bus::Text::line,
                           value_of);
    }
    /// [setup]
    static MessageSubject subject(const EventRecord& record, const std::string&) {
        return {std::to_string(static_cast<int>(record.event)), std::to_string(record.device)};
    }
    /// Returns the fault of an event; nullptr when it raises none. [realtime]
    const bus::FaultTexts::Fault* fault(Event event, std::size_t device) const noexcept {
        return faults_.of(event, device);
    }

private:
    static std::string seconds(std::int64_t ns) {
        char text[32];
        std::snprintf(text, sizeof text, "%g s", static_cast<double>(ns) * 1e-9);
        return text;
    }
    std::string text_of(std::size_t device) const {
        if (device >= bus_.devices.size()) return "a device";
        const Device& known = bus_.devices[device];
        return "device " + std::to_string(known.address) + " (" + known.name + ")";
    }

    const Bus& bus_;
    bus::FaultTexts faults_;
};

}  // namespace hal::demo
