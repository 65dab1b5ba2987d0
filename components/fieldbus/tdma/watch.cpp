// SPDX-License-Identifier: MIT
#include "watch.hpp"

namespace hal::tdma {

void Watch::heard(const Address& address) noexcept {
    for (std::size_t i = 0; i < used_; ++i)
        if (peers_[i].address == address) {
            ++peers_[i].frames;
            return;
        }
    if (used_ < peers_.size()) peers_[used_++] = {address, 1};
}

const Address* Watch::babbler(std::uint32_t limit, std::uint32_t& frames) noexcept {
    const Address* worst = nullptr;
    frames = limit;
    for (std::size_t i = 0; i < used_; ++i)
        if (peers_[i].frames > frames) frames = peers_[i].frames, found_ = peers_[i].address, worst = &found_;
    used_ = 0;  // an address that was invented once does not take a place for ever
    return worst;
}

}  // namespace hal::tdma
