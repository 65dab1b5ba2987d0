// SPDX-License-Identifier: MIT
// The faults of a station in words, made before the cycle that may need them.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "schedule.hpp"

namespace hal::tdma {

struct FaultWords {
    std::string sync_lost, other_master, master_there, withdrew, babbling, uncalibrated, period, other_schedule, out_of_step,
        no_carrier = "the line has no carrier";
    std::vector<std::pair<unsigned, std::string>> foreign;  // by slot

    explicit FaultWords(const StationSetup& s) {
        const std::string limit = std::to_string(s.lost_limit) + (s.lost_limit == 1 ? " cycle" : " cycles");
        sync_lost = "no sync for {} s (limit " + limit + "); the station is silent and its slots are empty";
        other_master = "second master on the segment with another schedule; it is not followed";
        master_there = "the segment has a master already; this one does not send until that one is gone";
        withdrew = "stepped down as master: there is another with a smaller address, and no station follows this one";
        babbling = "a station sends {} frames in one cycle";
        uncalibrated = "{} calibration requests were not answered; they are repeated";
        period = "the thread's period is {} us, the configuration's cycle is " + config::microseconds(s.cycle) +
                 "; nothing is sent: make them equal";
        other_schedule =
            "syncs come every {} us, this station's cycle is " + config::microseconds(s.cycle) + "; it follows nobody: give both the same";
        out_of_step = "the sync is heard, but this thread is {} us off and comes no nearer";
        for (const SlotSetup& slot : s.slots)
            foreign.emplace_back(slot.id, "another station sends in slot " + std::to_string(slot.id) + " of this one");
    }
};

}  // namespace hal::tdma
