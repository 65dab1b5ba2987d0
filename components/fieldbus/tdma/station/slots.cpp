// SPDX-License-Identifier: MIT
#include "slots.hpp"

#include <algorithm>

namespace hal::tdma {

Slot::Slot(const SlotSetup& setup, std::size_t queue)
    : setup_(setup),
      count_(std::max<std::size_t>(queue, 1)),
      places_(std::make_unique<Place[]>(count_)) {}

bool Slot::push(std::span<const std::uint8_t> frame, unsigned priority,
                ethernet::Finisher* finisher) noexcept {
    if (frame.size() < ethernet::header_bytes ||
        frame.size() > ethernet::header_bytes + setup_.size ||
        frame.size() > ethernet::largest_frame || waiting_ == count_ ||
        ahead_of(priority) + ethernet::wire_bytes(frame.size()) > turn_bytes()) {
        return false;
    }
    for (std::size_t i = 0; i < count_; ++i) {
        Place& place = places_[i];
        if (place.length != 0) continue;
        std::copy(frame.begin(), frame.end(), place.bytes.begin());
        place.length = static_cast<std::uint32_t>(frame.size());
        place.priority = priority;
        place.order = order_++;
        place.finisher = finisher;
        ++waiting_;
        return true;
    }
    return false;
}

std::size_t Slot::ahead_of(unsigned priority) const noexcept {
    std::size_t bytes = 0;
    for (std::size_t i = 0; waiting_ != 0 && i < count_; ++i) {
        if (const Place& p = places_[i]; p.length != 0 && p.priority <= priority) {
            bytes += ethernet::wire_bytes(p.length);
        }
    }
    return bytes;
}

std::size_t Slot::most_urgent() const noexcept {
    std::size_t best = count_;
    for (std::size_t i = 0; waiting_ != 0 && i < count_; ++i) {
        const Place& p = places_[i];
        if (p.length == 0) continue;
        if (best == count_ || p.priority < places_[best].priority ||
            (p.priority == places_[best].priority && p.order < places_[best].order)) {
            best = i;
        }
    }
    return best;
}

std::span<const std::uint8_t> Slot::front() const noexcept {
    const std::size_t i = most_urgent();
    return i == count_ ? std::span<const std::uint8_t>{}
                       : std::span<const std::uint8_t>(places_[i].bytes.data(), places_[i].length);
}

ethernet::Finisher* Slot::finisher() const noexcept {
    const std::size_t i = most_urgent();
    return i == count_ ? nullptr : places_[i].finisher;
}

void Slot::pop() noexcept {
    const std::size_t i = most_urgent();
    if (i != count_) {
        places_[i].length = 0;
        --waiting_;
    }
}

void Slot::clear() noexcept {
    for (std::size_t i = 0; i < count_; ++i) {
        places_[i].length = 0;
    }
    waiting_ = 0;
}

}  // namespace hal::tdma
