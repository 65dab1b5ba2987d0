// SPDX-License-Identifier: MIT
// What a configuration puts on the bus: its messages with their periods, for the response-time
// analysis. [setup]
#pragma once

#include <string>
#include <vector>

#include "fieldbus/can_timing/response_time.hpp"
#include "master_config.hpp"

namespace hal::canopen::config {

struct Schedule {
    can_timing::Bus bus;
    std::vector<can_timing::Message> messages;
    std::vector<std::string> names;  ///< of each message
    std::vector<Span> spans;   ///< of their lines
    std::vector<bool> assumed;       ///< its period is not given: counted once per SYNC or cycle
    unsigned per_sync = 0;           ///< frames that belong to one SYNC
    Time sync = 0;                   ///< its period; 0: none
    /// share of the SYNC's period that these frames take, at worst
    double sync_share = 0;
};

/// Lists all messages. `cycle` is the period of the master's thread. Emergencies, SDO and NMT are
/// not in it: they use the remaining time.
Schedule schedule_of(const MasterConfig&, Time cycle);

/// Returns one warning if the bus is overloaded, else nothing.
std::vector<Message> load_messages(const MasterConfig&, Time cycle, const std::string& path);

}  // namespace hal::canopen::config
