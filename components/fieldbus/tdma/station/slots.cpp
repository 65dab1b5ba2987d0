// SPDX-License-Identifier: MIT
#include "slots.hpp"

#include <algorithm>
#include <utility>

namespace hal::tdma {

Slot::Slot(const SlotSetup& setup, std::size_t queue)
    : setup_(setup),
      id_(setup.id),
      size_(setup.size),
      count_(std::max<std::size_t>(queue, 1)),
      front_(count_),
      places_(std::make_unique<Place[]>(count_)) {}

bool Slot::push(std::span<const std::uint8_t> frame, unsigned priority,
                ethernet::Finisher* finisher) noexcept {
    if (frame.size() < ethernet::header_bytes || frame.size() > ethernet::header_bytes + room() ||
        frame.size() > ethernet::largest_frame ||
        ahead_of(priority) + ethernet::wire_bytes(frame.size()) > turn_bytes()) {
        return false;
    }
    for (std::size_t i = 0; i < count_; ++i) {
        Place& place = places_[i];
        State expected = State::free;
        if (!place.state.compare_exchange_strong(expected, State::filling,
                                                 std::memory_order_acquire)) {
            continue;
        }
        std::copy(frame.begin(), frame.end(), place.bytes.begin());
        place.length.store(static_cast<std::uint32_t>(frame.size()), std::memory_order_relaxed);
        place.priority.store(priority, std::memory_order_relaxed);
        place.order = order_.fetch_add(1, std::memory_order_relaxed);
        place.finisher = finisher;
        place.state.store(State::ready, std::memory_order_release);
        waiting_.fetch_add(1, std::memory_order_release);
        return true;
    }
    return false;
}

std::size_t Slot::ahead_of(unsigned priority) const noexcept {
    std::size_t bytes = 0;
    for (std::size_t i = 0; waiting() != 0 && i < count_; ++i) {
        const Place& p = places_[i];
        if (p.is_ready() && p.priority.load(std::memory_order_relaxed) <= priority) {
            bytes += ethernet::wire_bytes(p.length.load(std::memory_order_relaxed));
        }
    }
    return bytes;
}

std::size_t Slot::most_urgent() const noexcept {
    // of a place: what leaves first has the smallest
    const auto rank = [](const Place& p) {
        return std::pair(p.priority.load(std::memory_order_relaxed), p.order);
    };
    std::size_t best = count_;
    for (std::size_t i = 0; waiting_.load(std::memory_order_acquire) != 0 && i < count_; ++i) {
        if (!places_[i].is_ready()) continue;
        if (best == count_ || rank(places_[i]) < rank(places_[best])) {
            best = i;
        }
    }
    return best;
}

std::span<const std::uint8_t> Slot::front() noexcept {
    front_ = most_urgent();
    if (front_ == count_) {
        return {};
    }
    const Place& place = places_[front_];
    return {place.bytes.data(), place.length.load(std::memory_order_relaxed)};
}

ethernet::Finisher* Slot::finisher() const noexcept {
    return front_ == count_ ? nullptr : places_[front_].finisher;
}

/// Frees a place that is ready. Returns false when it is not.
bool Slot::release(Place& place) noexcept {
    if (!place.is_ready()) return false;
    place.state.store(State::free, std::memory_order_release);
    waiting_.fetch_sub(1, std::memory_order_relaxed);
    return true;
}

void Slot::pop() noexcept {
    if (front_ != count_) {
        release(places_[front_]);
    }
    front_ = count_;
}

void Slot::clear() noexcept {
    for (std::size_t i = 0; waiting_.load(std::memory_order_acquire) != 0 && i < count_; ++i) {
        release(places_[i]);
    }
}

}  // namespace hal::tdma
