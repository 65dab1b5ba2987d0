// SPDX-License-Identifier: MIT
// One message for one cause: a start-up that fails is tried again and again, and fails for the same
// reason.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <iterator>
#include <vector>

#include "ethercat/master/events.hpp"

namespace hal::ethercat::config {

/// Decides which events of a master are worth a message.
class EventFilter {
public:
    /// `slaves`: how many the setup names. [setup]
    explicit EventFilter(std::size_t slaves) : slaves_(slaves) {}

    /// Returns whether an event is new. A failed start-up is news once for each cause, until the
    /// slave is operational, is lost or returns; that it failed at all is news only without a
    /// cause. [realtime]
    bool is_new(master::Event event, std::uint32_t slave, std::int64_t first,
                std::int64_t second) noexcept {
        using master::Event;
        if (slave >= slaves_.size()) return true;
        Slave& s = slaves_[slave];
        if (ends_start_up(event) || event == Event::slave_lost || event == Event::slave_returned) {
            s = {};
            return true;
        }
        if (!is_cause(event)) return true;
        if (event == Event::start_up_failed && s.count != 0) return false;
        // measured, or counted
        if (event == Event::dc_timeout || event == Event::start_up_failed) {
            first = second = 0;
        }
        const Cause cause{event, first, second};
        for (const Cause& known : s.known) {
            if (known == cause) return false;
        }
        s.known[s.count++ % s.known.size()] = cause;
        return true;
    }

private:
    static bool ends_start_up(master::Event event) noexcept {
        return event == master::Event::slave_operational || event == master::Event::slave_settled;
    }
    static bool is_cause(master::Event event) noexcept {
        using master::Event;
        constexpr Event causes[] = {
            Event::no_mailbox,      Event::too_few_fmmus,    Event::too_few_sync_managers,
            Event::state_refused,   Event::state_timeout,    Event::startup_write_failed,
            Event::no_eoe,          Event::eoe_failed,       Event::mapping_failed,
            Event::mapping_differs, Event::too_many_entries, Event::fixed_size,
            Event::dc_unsupported,  Event::dc_timeout,       Event::dc_not_set,
            Event::start_up_failed};
        return std::ranges::find(causes, event) != std::end(causes);
    }
    struct Cause {
        master::Event event = master::Event::scanned;  // is none
        std::int64_t first = 0;
        std::int64_t second = 0;
        friend bool operator==(const Cause&, const Cause&) = default;
    };
    struct Slave {
        std::array<Cause, 4> known{};
        unsigned count = 0;
    };
    std::vector<Slave> slaves_;
};

}  // namespace hal::ethercat::config
