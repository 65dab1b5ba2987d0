// SPDX-License-Identifier: MIT
// The emergencies (CoE, ETG.1000.6 clause 5.6.4) of the slaves, for their pins and for the log.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "ethercat/master/events.hpp"
#include "ethercat/master/mailbox.hpp"
#include "ethercat/wire/coe.hpp"

namespace hal::ethercat {

/// Takes the emergencies out of the mailboxes.
class Emergencies final : public master::MailboxSink {
public:
    struct Heard {
        std::uint16_t code = 0;  ///< of the newest; 0: none, or the errors are gone
        std::uint32_t count = 0;
    };
    /// [setup]
    Emergencies(std::size_t slaves, master::Events& events) : heard_(slaves), events_(events) {}
    /// `slave` as in the configuration. [realtime]
    const Heard& of(std::size_t slave) const noexcept { return heard_[slave]; }

    bool take(const master::BusSlave& slave, const MailboxMessage& message) noexcept override {
        if (message.payload.size() < coe::header_bytes ||
            coe::service_of(message.payload.data()) != coe::Service::emergency) {
            return false;
        }
        const auto emergency = coe::read_emergency(message.payload);
        if (!emergency) return false;
        std::int64_t data = 0;
        for (std::size_t n = sizeof emergency->data; n-- > 0;) {
            data = data << 8 | emergency->data[n];
        }
        const bool named =
            slave.configured >= 0 && static_cast<std::size_t>(slave.configured) < heard_.size();
        if (named) {
            Heard& heard = heard_[static_cast<std::size_t>(slave.configured)];
            heard.code = emergency->code;
            ++heard.count;
        }
        events_.on_event(master::Event::emergency,
                         named ? static_cast<std::uint32_t>(slave.configured)
                               : master::Events::of_position + slave.position,
                         emergency->code | std::int64_t{emergency->error_register} << 16, data);
        return true;
    }

private:
    std::vector<Heard> heard_;
    master::Events& events_;
};

}  // namespace hal::ethercat
