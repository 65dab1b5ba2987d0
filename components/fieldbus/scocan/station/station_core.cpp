// SPDX-License-Identifier: MIT
#include "fieldbus/scocan/station/station_core.hpp"

#include <algorithm>

namespace hal::scocan {

SlotTime StationCore::where(Time local) const noexcept {
    SlotTime result;
    if (!clock.known()) return result;
    const Time slack = table.guard / 2;
    const double behind = static_cast<double>(local - clock.start() + slack) / clock.period();
    if (!(behind > -4 && behind < 1e6)) return result;
    auto cycles = static_cast<std::int64_t>(behind);
    if (behind < static_cast<double>(cycles)) {
        --cycles;
    }
    const auto slot =
        static_cast<std::uint32_t>((behind - static_cast<double>(cycles)) * table.slots);
    result.known = true;
    result.at.cycle = clock.cycle() + static_cast<std::uint64_t>(cycles);
    result.at.slot = std::min(slot, table.slots - 1);
    result.counter = counter_of(result.at.cycle);
    result.offset = local - begin_of(result.at);
    return result;
}

bool StationCore::send(const can::Frame& frame, can::Window w) noexcept {
    if (!windows) return link->send(frame, now) == can::Sent::queued;
    w.not_before_ns = crystal.bus(w.not_before_ns);
    if (w.last_start_ns != INT64_MAX) {
        w.last_start_ns = crystal.bus(w.last_start_ns);
    }
    if (w.idle_from_ns != w.idle_until_ns) {
        w.idle_from_ns = crystal.bus(w.idle_from_ns);
        w.idle_until_ns = crystal.bus(w.idle_until_ns);
    }
    return link->send_within(frame, w, now) == can::Sent::queued;
}

}  // namespace hal::scocan
