// SPDX-License-Identifier: MIT
// The stations of a segment, from the pins of a running machine.
#pragma once

#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "control/client.hpp"

namespace hal::tools {

/// of one instance of `tdma`, by the rest of their names
using StationPins = std::map<std::string, nlohmann::json>;

/// By the names of the instances: tdma.0 …; sets `problem` when the machine did not report it.
std::map<std::string, StationPins> stations_of(Client&, std::string& problem);

/// The machine of an instance, and the stations of its segments.
struct SegmentMachine {
    std::unique_ptr<Client> client;
    std::map<std::string, StationPins> instances;

    /// Connects to instance `name`, empty: the one that runs, and reads its stations. Returns the
    /// problem, or ""; without a problem there is at least one instance of `tdma`.
    std::string connect(const std::string& name);
};

double number(const StationPins&, const std::string& name);  ///< 0 where there is none
bool is_on(const StationPins&, const std::string& name);

}  // namespace hal::tools
