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
    guardian_lost,
    guardian_stalls,
    guardian_runs,
    guardian_killed,
    previous_stop,
    not_sent,  ///< at the end of the component
};

inline constexpr bus::EventRow<Event> event_rows[] = {
    {Event::stopping, bus::Effect::none, "sends the stop frames: {reason}"},
    {Event::sent, bus::Effect::ends, "the stop frames were sent {rounds} after {time}"},
    {Event::confirmed, bus::Effect::ends,
     "the stop frames were sent {rounds} and confirmed after {time}"},
    {Event::unconfirmed, bus::Effect::raises,
     "the stop frames were not confirmed[ although they were sent {rounds}; stop the drives by "
     "other means]"},
    {Event::delayed, bus::Effect::raises,
     "the stop frames are not sent: {link} does not take or acknowledge them[; they are sent as "
     "soon as it does]"},
    {Event::guardian_lost, bus::Effect::raises,
     "the guardian has ended: nothing sends the stop frames any more[; type: unloadrt, loadrt]"},
    {Event::guardian_stalls, bus::Effect::raises,
     "the guardian stalls: no stop frame is sent[; stop the drives by other means]"},
    {Event::guardian_runs, bus::Effect::ends, "the guardian runs again"},
    {Event::guardian_killed, bus::Effect::none,
     "the guardian did not end in time and was killed; stop the drives by other means"},
    {Event::previous_stop, bus::Effect::none, "the guardian of the previous run: {report}"},
    {Event::not_sent, bus::Effect::none,
     "{link} has not taken the stop frames within 2 s ({rounds} sent); stop the drives by other "
     "means"},
};
static_assert(bus::in_order(event_rows));

}  // namespace hal::guardian
