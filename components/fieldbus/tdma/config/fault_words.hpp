// SPDX-License-Identifier: MIT
// The fault messages of a station, formatted before the cycle that may need them.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "schedule.hpp"
#include "text/quoting.hpp"

namespace hal::tdma {

struct FaultWords {
    std::string sync_lost, other_master, master_there, withdrew, babbling, uncalibrated, period,
        other_schedule, out_of_step, no_carrier = "no carrier",
                                     duplicate_slot = "two stations send in the same slots";
    std::vector<std::pair<unsigned, std::string>> foreign;  // by slot

    explicit FaultWords(const StationSetup& s) {
        const std::string limit = counted(s.lost_limit, "cycle");
        sync_lost = "no sync for {} s (limit " + limit + "); the station stopped sending";
        other_master = "second master on the segment with another schedule; it is not followed";
        master_there =
            "the segment has a master already; this one does not send until that one is gone";
        withdrew =
            "stepped down as master: there is another with a smaller address, and no station "
            "follows this one";
        babbling = "a station sends {} frames in one cycle";
        uncalibrated = "{} calibration requests were not answered; still trying";
        period = "the period of the thread is {} us, the cycle of the schedule is " +
                 config::microseconds(s.cycle) + "; nothing is sent until they are equal";
        other_schedule = "syncs ignored: their cycle is {} us, that of this station " +
                         config::microseconds(s.cycle) + "; configure the same cycle on both";
        out_of_step = "cannot synchronise: the offset of this thread stays at {} us";
        for (const SlotSetup& slot : s.slots) {
            foreign.emplace_back(slot.id, "another station sends in slot " +
                                              std::to_string(slot.id) + " of this one");
        }
    }
};

}  // namespace hal::tdma
