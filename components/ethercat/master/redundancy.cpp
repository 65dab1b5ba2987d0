// SPDX-License-Identifier: MIT
// Where a ring is broken: the copy of a broadcast that left on the primary port passes all slaves of a
// closed ring, and only those before the break of a broken one.
#include "ethercat/master/bus.hpp"

namespace hal::ethercat::master {

void judge_ring(Bus& bus, unsigned responding) noexcept {
    const unsigned reached = bus.engine.primary_wkc();
    const bool broken = reached < responding;
    bus.status.break_after = broken ? static_cast<std::int16_t>(static_cast<int>(reached) - 1) : std::int16_t{-1};
    if (broken == bus.status.ring_broken) return;
    bus.status.ring_broken = broken;
    const Event event = broken ? Event::ring_broken : Event::ring_closed;
    if (broken && reached > 0 && reached <= bus.by_position.size())
        bus.report(event, *bus.devices[bus.by_position[reached - 1]], reached - 1, reached);
    else
        bus.report(event, -1, reached);
}

}  // namespace hal::ethercat::master
