// SPDX-License-Identifier: MIT
// What was typed behind `hal node KIND`.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace hal::tools {

struct NodeOptions {
    std::string link, id;
    bool eds = false;                          ///< print the EDS and end
    std::vector<std::string> faults, settings; ///< --fault, --set
    std::uint16_t heartbeat_ms = 0;
    std::uint32_t serial = 1;
    bool starts_itself = false;
    std::string tdma, station, tunnel, skew, drift;                               // of a TDMA station
    std::string plant = "axis";                                                   // axis-io
    bool input_stops = false;
    unsigned axes = 1;                                                            // drive
    std::vector<std::string> motor;
    unsigned inputs = 64, outputs = 64, analog_inputs = 12, analog_outputs = 12;  // io
    std::string stream, record;                                                   // jr3
    std::string flash, version = "1.0", image;                                    // bootloader
};

}  // namespace hal::tools
