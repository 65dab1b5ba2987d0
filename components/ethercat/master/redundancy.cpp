// SPDX-License-Identifier: MIT
// Where a ring is broken, by counting. On a closed ring the copy of a broadcast that left on the
// primary port passes all slaves and arrives at the backup port; the other copy arrives at the
// primary port and was processed by nobody. On a broken ring the primary port's copy returns to
// it, from the slaves before the break.
#include "ethercat/master/bus.hpp"

namespace hal::ethercat::master {

void check_ring(Bus& bus, unsigned responding) noexcept {
    const int at_primary = bus.engine.primary_wkc();
    if (responding == 0) return;
    const bool broken = at_primary != 0;
    const unsigned reached = at_primary < 0 ? 0 : static_cast<unsigned>(at_primary);
    // A lost copy looks like a break: only what is seen twice counts.
    if (broken == bus.status.ring_broken &&
        (!broken || static_cast<int>(reached) - 1 == bus.status.break_after)) {
        bus.ring_changed = false;
        return;
    }
    if (!std::exchange(bus.ring_changed, true)) {
        bus.suspicious = true;
        return;
    }
    bus.ring_changed = false;
    bus.status.break_after =
        broken ? static_cast<std::int16_t>(static_cast<int>(reached) - 1) : std::int16_t{-1};
    if (broken == bus.status.ring_broken) {
        return;  // broken in another place
    }
    bus.status.ring_broken = broken;
    const Event event = broken ? Event::ring_broken : Event::ring_closed;
    if (broken && reached > 0 && reached <= bus.by_position.size()) {
        bus.report(event, *bus.devices[bus.by_position[reached - 1]], reached - 1, reached);
    } else {
        bus.report(event, -1, reached);
    }
}

}  // namespace hal::ethercat::master
