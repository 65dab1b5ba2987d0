// SPDX-License-Identifier: MIT
// Transmit windows: frames that may start at certain times only.
#include <algorithm>

#include "can_bus.hpp"

namespace hal::can::simbus {

/// Discards the frames whose window does not allow a start any more. Returns true when there was
/// one.
bool Bus::discard_expired(std::int64_t start) noexcept {
    bool any = false;
    for (Node* n : nodes) {
        const Outgoing* f = n->outgoing.front();
        if (f == nullptr || f->time_ns > start) continue;
        if (std::max(start, n->hold_until) <= f->last_start &&
            was_idle(f->idle_from, f->idle_until)) {
            continue;
        }
        discard(*n);
        any = true;
    }
    return any;
}

/// Returns true when no frame started in [from, until).
bool Bus::was_idle(std::int64_t from, std::int64_t until) const noexcept {
    if (from == until) return true;
    for (std::size_t i = 0; i < std::min(started_, starts_.size()); ++i) {
        const auto start = starts_[(started_ - 1 - i) % starts_.size()];
        if (start < from) return true;
        if (start < until) return false;
    }
    return true;
}

void Bus::discard(Node& n) noexcept {
    n.delayed = n.doubled = n.counted = false;
    n.thrown_away.fetch_add(1, std::memory_order_relaxed);
    n.outgoing.drop();
}

}  // namespace hal::can::simbus
