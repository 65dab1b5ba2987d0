// SPDX-License-Identifier: MIT
// What a configuration puts on the bus: its messages with their periods, for the response-time analysis. [setup]
#pragma once

#include <string>
#include <vector>

#include "canopen/master/plan/response_time.hpp"
#include "master_config.hpp"

namespace hal::canopen::config {

struct Schedule {
    plan::Bus                  bus;
    std::vector<plan::Message> messages;
    std::vector<std::string>   names;  ///< of each message
    std::vector<Place>         places;       ///< where the file says it
    std::vector<bool> assumed;       ///< nothing says how often it comes at most: counted once a SYNC or cycle
    unsigned                   per_sync = 0;           ///< frames that belong to one SYNC
    Time                       sync = 0;                   ///< its period; 0: none
    double                     sync_share = 0;           ///< share of the SYNC's period that these frames take, at worst
};

/// `cycle`: the period of the master's thread. Emergencies, SDO and NMT are not in it: they have what is left.
Schedule schedule_of(const MasterConfig&, Time cycle);

/// Where the bus does not fit, one message about it; nothing when it fits.
std::vector<Message> load_messages(const MasterConfig&, Time cycle, const std::string& path);

}  // namespace hal::canopen::config
