// SPDX-License-Identifier: MIT
#include "other_masters.hpp"

#include <algorithm>
#include <cstdlib>

namespace hal::tdma {

void OtherMasters::restart() noexcept {
    claimants_ = {};
    heard_ = 0;
    reported_ = false;
    established_ = false;
}

void OtherMasters::tick() noexcept {
    other_gate_.tick();
    unknown_gate_.tick();
}

void OtherMasters::expire(Time now) noexcept {
    if (heard_ == 0 || now - heard_ <= gone_after) return;
    heard_ = 0;
    if (reported_) {
        core_.report(Event::other_master_gone, other_);
    }
    reported_ = false;
}

bool OtherMasters::allows(const Address& master) noexcept {
    const auto& masters = core_.setup.masters;
    if (masters.empty()) return true;
    if (std::find(masters.begin(), masters.end(), master) != masters.end()) return true;
    ++core_.status.count.foreign;
    if (unknown_gate_.pass()) {
        core_.report(Event::unknown_master, master);
    }
    return false;
}

/// Returns the last entry of a sender, or nullptr.
const Claimant* OtherMasters::find(const Address& who) const noexcept {
    const Claimant* found = nullptr;
    for (const Claimant& known : claimants_) {
        if (known.row != 0 && known.who == who) {
            found = &known;
        }
    }
    return found;
}

const Claimant& OtherMasters::claim(const Decoded& d, Time arrived) noexcept {
    const Sync& s = d.sync;
    const auto offset = static_cast<Time>(static_cast<std::uint64_t>(s.stamp) -
                                          static_cast<std::uint64_t>(arrived));
    const Claimant* const known = find(d.from);
    if (known == nullptr) {
        Claimant& added = claimants_[next_claimant_++ % claimants_.size()];
        added = {d.from, s.cycle, 1, s.scheduled, 0, offset};
        return added;
    }
    Claimant* const c = &claimants_[static_cast<std::size_t>(known - claimants_.data())];
    const auto cycles = static_cast<std::int32_t>(s.cycle - c->cycle);
    const Time every = cycles > 0 && cycles < 1000 ? (s.scheduled - c->scheduled) / cycles : 0;
    const bool consistent =
        every > 0 && (c->row == 1 || std::abs(every - c->every) <= core_.setup.guard);
    *c = {d.from, s.cycle, consistent ? c->row + 1 : 1, s.scheduled, every, offset};
    return *c;
}

std::optional<SlotTime> OtherMasters::left_at(Time arrived, std::size_t length) const noexcept {
    const Claimant* const c = present() ? find(other_) : nullptr;
    if (c == nullptr || !c->confirmed()) return std::nullopt;
    const Time longer = 2 * (core_.wire(length) - core_.wire(0));  // stored and forwarded once
    const Time into = arrived + c->offset - longer - c->scheduled;
    const Time cycles = core_.cycles_in(into);
    return SlotTime{c->cycle + static_cast<std::uint32_t>(cycles),
                    into - cycles * core_.setup.cycle};
}

void OtherMasters::confirm(const Address& who, const Followers& followers, Time now) noexcept {
    const bool first = heard_ == 0;
    other_ = who;
    heard_ = now;
    if (first) {
        since_ = now;
        established_ = followers.any(now, gone_after);
    }
    if (reported_ && !other_gate_.open()) return;
    other_gate_.close();
    reported_ = true;
    core_.report(Event::other_master, who);
}

void OtherMasters::refresh(const Address& from, Time now) noexcept {
    if (heard_ != 0 && from == other_) {
        heard_ = now;
    }
}

}  // namespace hal::tdma
