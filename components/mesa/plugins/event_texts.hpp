// SPDX-License-Identifier: MIT
// The events of a card: the lines that are printed, and the texts of those that are faults.
#pragma once

#include <string>
#include <string_view>

#include "bus/events/event_rows.hpp"
#include "hal/message_log.hpp"

namespace hal::mesa {

enum class Event : std::uint8_t {
    online,
    lost,
    returned,
    returned_bitten,
    was_reset,
    was_reset_bitten,
    bitten,
    still_bitten,
    contended,
    position_lost,
    positions_valid,
    setting_waits,
    encoder_gap,
    remote_lost,
    remote_online,
    period_too_long,
    hold_too_long,
    timeout_too_long,
    module_unused,
};

struct EventRecord {
    Event event;
    std::uint32_t unit = 0;  ///< step generator, encoder, remote device, unused module
    std::int64_t value = 0;
};

inline constexpr bus::EventRow<Event> event_rows[] = {
    {Event::online, bus::Effect::ends, "{card} is online"},
    {Event::lost, bus::Effect::raises,
     "{card} is lost: no answer in {value} cycles[; check its power and its cable]",
     "; its watchdog switches its outputs off within watchdog.timeout_ns"},
    {Event::returned, bus::Effect::none, "{card} answers again; it is configured"},
    {Event::returned_bitten, bus::Effect::none,
     "{card} answers again; its outputs stay off until watchdog.has_bit is set to FALSE"},
    {Event::was_reset, bus::Effect::none, "{card} was reset; it is configured again"},
    {Event::was_reset_bitten, bus::Effect::none,
     "{card} was reset; its outputs stay off until watchdog.has_bit is set to FALSE"},
    {Event::bitten, bus::Effect::raises,
     "the watchdog of {card} has bitten: no cycle has written to it in time[; set "
     "watchdog.has_bit to FALSE to go on]",
     "; its outputs are off until watchdog.has_bit is set to FALSE"},
    {Event::still_bitten, bus::Effect::raises,
     "the watchdog of {card} had bitten before the reload[; set watchdog.has_bit to FALSE to go "
     "on]",
     "; its outputs are off until watchdog.has_bit is set to FALSE"},
    {Event::contended, bus::Effect::raises,
     "another master writes to {card}[; stop it: a card has one master]",
     "; nothing is written until it has stopped for 1 s"},
    {Event::position_lost, bus::Effect::raises,
     "stepgen {unit} has lost its position: its motor may not have followed its steps[; home the "
     "axis; it moves again after enable was FALSE]",
     "; it stands until enable was FALSE"},
    {Event::positions_valid, bus::Effect::ends, "all step generators are released again"},
    {Event::setting_waits, bus::Effect::none,
     "stepgen {unit} runs: a changed position-scale, step_type or swap_step_dir applies once its "
     "enable is FALSE"},
    {Event::encoder_gap, bus::Effect::none,
     "encoder {unit} may have lost counts while the card was lost; home the axis"},
    {Event::remote_lost, bus::Effect::raises,
     "{remote} does not answer[; check its cable and its field power]"},
    {Event::remote_online, bus::Effect::ends, "{remote} answers again"},
    {Event::period_too_long, bus::Effect::none,
     "the period is {value} us, longer than watchdog.timeout_ns: the watchdog of {card} bites "
     "between two cycles; raise watchdog.timeout_ns"},
    {Event::hold_too_long, bus::Effect::none,
     "hold-cycles is {value} ms, longer than watchdog.timeout_ns: the watchdog of {card} bites "
     "before the card counts as lost; lower hold-cycles"},
    {Event::timeout_too_long, bus::Effect::none,
     "watchdog.timeout_ns is {value} ms, more than 20 ms longer than hold-cycles: the motors of "
     "{card} may run on for that time when it is lost; lower watchdog.timeout_ns"},
    {Event::module_unused, bus::Effect::none, "{card}: {module}"},
};
static_assert(bus::in_order(event_rows));

/// Formats the events of a card. All functions but fault() are [setup].
class EventTexts {
public:
    /// `card` names the card; `remotes` are the names of the devices on smart serial; `unused`
    /// describes the modules that are not used.
    EventTexts(std::string card, std::vector<std::string> remotes, std::vector<std::string> unused,
               std::size_t subjects)
        : card_(std::move(card)),
          remotes_(std::move(remotes)),
          unused_(std::move(unused)),
          faults_(event_rows, std::max(subjects, remotes_.size()),
                  [this](Event event, std::size_t unit, std::string_view name) {
                      return value_of(name, {event, static_cast<std::uint32_t>(unit), 0});
                  }) {}

    std::string line(const EventRecord& record) const {
        return bus::format(event_rows[static_cast<std::size_t>(record.event)].text, bus::Text::line,
                           [&](std::string_view name) { return value_of(name, record); });
    }
    static MessageSubject subject(const EventRecord& record, const std::string&) {
        return {std::to_string(static_cast<int>(record.event)), std::to_string(record.unit)};
    }
    /// Returns the fault of an event; nullptr when it raises none. [realtime]
    const bus::FaultTexts::Fault* fault(const EventRecord& record) const noexcept {
        return faults_.of(record.event, record.unit);
    }

private:
    std::string value_of(std::string_view name, const EventRecord& record) const {
        if (name == "card") return "the card " + card_;
        if (name == "value") return std::to_string(record.value);
        if (name == "unit") {
            const std::string number = std::to_string(record.unit);
            return number.size() < 2 ? "0" + number : number;
        }
        if (name == "remote") {
            return record.unit < remotes_.size() ? remotes_[record.unit] : "a remote device";
        }
        if (name == "module") return record.unit < unused_.size() ? unused_[record.unit] : "";
        return {};
    }

    const std::string card_;
    const std::vector<std::string> remotes_;
    const std::vector<std::string> unused_;
    bus::FaultTexts faults_;
};

}  // namespace hal::mesa
