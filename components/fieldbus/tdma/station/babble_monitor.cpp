// SPDX-License-Identifier: MIT
#include "babble_monitor.hpp"

#include <algorithm>

namespace hal::tdma {

void BabbleMonitor::heard(const Address& address, Time arrived, Time cycle) noexcept {
    for (std::size_t i = 0; i < used_; ++i) {
        Peer& p = peers_[i];
        if (p.address != address) continue;
        if (arrived - p.since >= cycle) {
            p.since = arrived;
            p.frames = 0;
        }
        p.max_frames = std::max(p.max_frames, ++p.frames);
        return;
    }
    if (used_ < peers_.size()) {
        peers_[used_++] = {address, arrived, 1, 1};
    }
}

const Address* BabbleMonitor::babbler(std::uint32_t limit, std::uint32_t& frames) noexcept {
    const Address* worst = nullptr;
    frames = limit;
    for (std::size_t i = 0; i < used_; ++i) {
        if (peers_[i].max_frames > frames) {
            frames = peers_[i].max_frames;
            found_ = peers_[i].address;
            worst = &found_;
        }
    }
    used_ = 0;  // a forged address does not keep its entry
    return worst;
}

}  // namespace hal::tdma
