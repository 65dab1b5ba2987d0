// SPDX-License-Identifier: MIT
// The events of a bus: the lines that are printed, and the texts of those that are faults.
#pragma once

#include <cstdio>
#include <string>
#include <string_view>

#include "bus/events/event_rows.hpp"
#include "hal/message_log.hpp"
#include "modbus/master/image.hpp"

namespace hal::modbus {

inline constexpr bus::EventRow<Event> event_rows[] = {
    {Event::slave_online, bus::Effect::ends, "{slave} is online"},
    {Event::slave_offline, bus::Effect::raises,
     "{slave} is offline: no valid answer to {lost} requests[; check its address, baud rate, "
     "parity and wiring]"},
    {Event::slave_corrupt, bus::Effect::none,
     "{slave}: answer with a wrong check sequence; check baud rate, parity and wiring"},
    {Event::exception, bus::Effect::none, "{slave} rejects {request}: {exception}{place}"},
    {Event::line_lost, bus::Effect::raises,
     "{link} is lost[; it is opened again as soon as possible]"},
    {Event::line_open, bus::Effect::ends, "{link} is open again"},
    {Event::stopping, bus::Effect::none, "sends the stop telegrams: {reason}"},
    {Event::stop_acknowledged, bus::Effect::ends,
     "{slave} acknowledged its stop telegrams after {time}"},
    {Event::stop_unconfirmed, bus::Effect::raises,
     "{slave} did not acknowledge its stop telegrams[; stop it by other means]"},
    {Event::guardian_lost, bus::Effect::raises,
     "the guardian has ended; another one sends the stop telegrams, and nothing else is "
     "exchanged[; type: unloadrt, loadrt]"},
    {Event::previous_stop, bus::Effect::none, "the guardian of the previous run: {report}"},
    {Event::slave_rejects, bus::Effect::raises,
     "{slave} rejects requests: their values are not read, or not written"},
    {Event::slave_accepts, bus::Effect::ends, "{slave} accepts all requests again"},
    {Event::guardian_stalls, bus::Effect::raises,
     "the guardian stalls; nothing is exchanged, and no stop telegram is sent[; stop the drives by "
     "other means]"},
    {Event::guardian_runs, bus::Effect::ends, "the guardian runs again"},
    {Event::guardian_killed, bus::Effect::none,
     "the guardian did not end within {limit} and was killed; stop the drives by other means"},
    {Event::stop_broadcast, bus::Effect::none,
     "the broadcast stop was sent after {time}; no slave acknowledges a broadcast"},
    {Event::stop_unfinished, bus::Effect::none,
     "not all stop telegrams were sent within {limit}; stop the drives by other means"},
    {Event::value_changes, bus::Effect::raises,
     "{slave}: a value that changes between all answers is not accepted[: {value}; "
     "{remedy}{place}]"},
    {Event::values_accepted, bus::Effect::ends, "{slave}: all values are accepted again"},
};
static_assert(bus::in_order(event_rows));

/// Formats the events of a bus. All functions but fault() are [setup].
class EventTexts {
public:
    /// Both outlive it.
    EventTexts(const Bus& bus, const Plan& plan)
        : bus_(bus),
          plan_(plan),
          faults_(event_rows, bus.slaves.size(),
                  [this](Event event, std::size_t slave, std::string_view name) {
                      return value_of(name, {event, static_cast<std::uint32_t>(slave), 0, 0});
                  }) {}

    std::string line(const EventRecord& record) const {
        return bus::format(event_rows[static_cast<std::size_t>(record.event)].text, bus::Text::line,
                           [&](std::string_view name) { return value_of(name, record); });
    }
    static MessageSubject subject(const EventRecord& record, const std::string&) {
        const int event = static_cast<int>(record.event);
        if (record.event == Event::stopping) {
            // each cause is a message of its own, and is not counted with another one
            return {std::to_string(event * 65536), std::to_string(record.value)};
        }
        return {std::to_string(event * 65536 + static_cast<int>(record.telegram & 0xffff)),
                std::to_string(record.slave)};
    }
    /// Returns the fault of an event; nullptr when it raises none. [realtime]
    const bus::FaultTexts::Fault* fault(Event event, std::size_t slave) const noexcept {
        return faults_.of(event, slave);
    }

private:
    std::string value_of(std::string_view name, const EventRecord& r) const {
        if (name == "slave") return slave_text(r.slave);
        if (name == "lost" && r.slave < bus_.slaves.size()) {
            return std::to_string(bus_.slaves[r.slave].lost);
        }
        if (name == "request") return request(r);
        if (name == "exception") {
            const auto code = static_cast<std::uint8_t>(r.value);
            return std::string(exception_name(code)) + " (exception " + std::to_string(code) + ")";
        }
        if (name == "place") return place(r);
        if (name == "value" && is_value(r)) return value_at(r).name;
        if (name == "remedy") {
            return bus_.slaves[r.slave].confirm == Confirm::always
                       ? "write confirm = errors for this slave"
                       : "repair the line, or write confirm = no for this slave";
        }
        if (name == "link") return bus_.link;
        if (name == "reason") return bus::to_string(static_cast<StopReason>(r.value));
        if (name == "time") {
            char text[32];
            std::snprintf(text, sizeof text, "%.1f ms", static_cast<double>(r.value) * 1e-6);
            return text;
        }
        if (name == "limit") return std::to_string((r.value + 999'999'999) / 1'000'000'000) + " s";
        return {};
    }
    std::string slave_text(std::size_t slave) const {
        if (slave >= bus_.slaves.size()) return "a slave";
        const Slave& s = bus_.slaves[slave];
        return "slave " + std::to_string(s.unit) + " (" + s.name + ")";
    }
    std::string request(const EventRecord& r) const {
        if (r.telegram >= plan_.telegrams.size()) return "a stop telegram";
        const Telegram& t = plan_.telegrams[r.telegram];
        if (t.kind == Telegram::Kind::drive) return "a command of its profile";
        char text[64];
        std::snprintf(text, sizeof text,
                      t.count == 1 ? "%s of %s 0x%04X" : "%s of %s 0x%04X..0x%04X",
                      t.kind == Telegram::Kind::read ? "the read" : "the write",
                      modbus::to_string(t.table), t.address, t.address + t.count - 1U);
        return text;
    }
    bool is_value(const EventRecord& r) const {
        return r.event == Event::value_changes && r.value >= 0 &&
               static_cast<std::size_t>(r.value) < plan_.values.size();
    }
    const Value& value_at(const EventRecord& r) const {
        return *plan_.values[static_cast<std::size_t>(r.value)].value;
    }
    std::string place(const EventRecord& r) const {
        Span at = bus_.slaves[r.slave].at;
        if (is_value(r)) {
            at = value_at(r).at;
        } else if (r.telegram < plan_.telegrams.size() &&
                   !plan_.telegrams[r.telegram].values.empty()) {
            at = plan_.values[plan_.telegrams[r.telegram].values.front()].value->at;
        }
        return "; see " + bus_.file + ":" + std::to_string(at.line);
    }

    const Bus& bus_;
    const Plan& plan_;
    bus::FaultTexts faults_;
};

}  // namespace hal::modbus
