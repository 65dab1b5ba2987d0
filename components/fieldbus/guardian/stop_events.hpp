// SPDX-License-Identifier: MIT
// The events of stop frames: the lines that are printed, and the texts of those that are faults.
#pragma once

#include <cstdint>

#include "bus/events/event_rows.hpp"

namespace hal::guardian {

/// What happens; the rows of event_rows are in this order.
enum class Event : std::uint8_t {
    stopping,
    sent,
    confirmed,
    unconfirmed,
    delayed,
    link_lost,  ///< while nothing is sent
    link_ready,
    guardian_lost,
    guardian_stuck,
    guardian_replaced,
    guardian_missing,
    guardian_stalls,
    guardian_runs,
    guardian_killed,
    previous_stop,
    not_sent,  ///< at the end of the component
};

inline constexpr bus::EventRow<Event> event_rows[] = {
    {Event::stopping, bus::Effect::none, "sends the stop frames: {reason}"},
    {Event::sent, bus::Effect::ends, "the stop frames were {sent} {rounds} after {time}"},
    {Event::confirmed, bus::Effect::ends,
     "the stop frames were {sent} {rounds} and confirmed after {time}"},
    {Event::unconfirmed, bus::Effect::raises,
     "the stop frames were not confirmed[ although they were {sent} {rounds}; stop the drives by "
     "other means]"},
    {Event::delayed, bus::Effect::raises,
     "the stop frames are not sent: {link} does not accept or acknowledge them[: {unsent}; they "
     "are tried again until it does]"},
    {Event::link_lost, bus::Effect::raises,
     "{link} is down or bus off: a stop frame could not be sent now"},
    {Event::link_ready, bus::Effect::ends, "{link} is ready again"},
    {Event::guardian_lost, bus::Effect::raises,
     "the guardian has ended: nothing sends the stop frames[ until another one is started]"},
    {Event::guardian_stuck, bus::Effect::none,
     "the guardian has stalled for 1.5 s and is killed; another one is started"},
    {Event::guardian_replaced, bus::Effect::ends,
     "another guardian has taken over[; it sends what the first one has not sent]"},
    {Event::guardian_missing, bus::Effect::none,
     "no other guardian can be started: {problem}; it is tried again every second; stop the drives "
     "by other means"},
    {Event::guardian_stalls, bus::Effect::raises,
     "the guardian stalls: no stop frame is sent[; stop the drives by other means]"},
    {Event::guardian_runs, bus::Effect::ends, "the guardian runs again"},
    {Event::guardian_killed, bus::Effect::none,
     "the guardian has not finished its last stop; another one sends the stop frames"},
    {Event::previous_stop, bus::Effect::none, "the guardian of the previous run: {report}"},
    {Event::not_sent, bus::Effect::none,
     "not all stop frames were sent on {link} in time ({sent} {rounds}: {unsent}); stop the drives "
     "by "
     "other means"},
};
static_assert(bus::in_order(event_rows));

}  // namespace hal::guardian
