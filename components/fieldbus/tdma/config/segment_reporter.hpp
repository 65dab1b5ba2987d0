// SPDX-License-Identifier: MIT
// Prints the events of a segment on standard error: recorded by the cycle, formatted outside of it.
#pragma once

#include <string>
#include <utility>

#include "event_texts.hpp"
#include "hal/reporter.hpp"

namespace hal::tdma {

class Reporter {
public:
    /// The schedule outlives it; `known_as` as of EventTexts. [setup]
    Reporter(const std::string& instance, const config::Schedule& schedule,
             std::string known_as = {})
        : texts_(schedule, "setp " + instance + ".reset TRUE", std::move(known_as)),
          reported_(instance, [this](const EventRecord& h) { return texts_.line(h); }, 256,
                    [](const EventRecord& h, const std::string&) { return subject(h); }) {}

    void start() { reported_.start(); }  // [setup]
    void stop() noexcept { reported_.stop(); }  // [setup]
    /// By the cycle. [realtime]
    void event(Event event, const Address& who, Time value) noexcept {
        reported_.tell({event, who, value});
    }

private:
    const EventTexts texts_;
    hal::Reporter<EventRecord> reported_;  // the last: its thread uses the texts
};

}  // namespace hal::tdma
