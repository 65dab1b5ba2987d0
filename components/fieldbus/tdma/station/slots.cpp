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
      entries_(std::make_unique<Entry[]>(count_)) {}

bool Slot::push(std::span<const std::uint8_t> frame, unsigned priority,
                ethernet::Finisher* finisher) noexcept {
    if (frame.size() < ethernet::header_bytes ||
        frame.size() > ethernet::header_bytes + capacity() ||
        frame.size() > ethernet::largest_frame ||
        ahead_of(priority) + ethernet::wire_bytes(frame.size()) > turn_bytes()) {
        return false;
    }
    for (std::size_t i = 0; i < count_; ++i) {
        Entry& entry = entries_[i];
        State expected = State::free;
        if (!entry.state.compare_exchange_strong(expected, State::filling,
                                                 std::memory_order_acquire)) {
            continue;
        }
        std::copy(frame.begin(), frame.end(), entry.bytes.begin());
        entry.length.store(static_cast<std::uint32_t>(frame.size()), std::memory_order_relaxed);
        entry.priority.store(priority, std::memory_order_relaxed);
        entry.order = order_.fetch_add(1, std::memory_order_relaxed);
        entry.finisher = finisher;
        entry.state.store(State::ready, std::memory_order_release);
        waiting_.fetch_add(1, std::memory_order_release);
        return true;
    }
    return false;
}

std::size_t Slot::ahead_of(unsigned priority) const noexcept {
    std::size_t bytes = 0;
    for (std::size_t i = 0; waiting() != 0 && i < count_; ++i) {
        const Entry& p = entries_[i];
        if (p.is_ready() && p.priority.load(std::memory_order_relaxed) <= priority) {
            bytes += ethernet::wire_bytes(p.length.load(std::memory_order_relaxed));
        }
    }
    return bytes;
}

std::size_t Slot::most_urgent() const noexcept {
    // of a place: what leaves first has the smallest
    const auto rank = [](const Entry& p) {
        return std::pair(p.priority.load(std::memory_order_relaxed), p.order);
    };
    std::size_t best = count_;
    for (std::size_t i = 0; waiting_.load(std::memory_order_acquire) != 0 && i < count_; ++i) {
        if (!entries_[i].is_ready()) continue;
        if (best == count_ || rank(entries_[i]) < rank(entries_[best])) {
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
    const Entry& entry = entries_[front_];
    return {entry.bytes.data(), entry.length.load(std::memory_order_relaxed)};
}

ethernet::Finisher* Slot::finisher() const noexcept {
    return front_ == count_ ? nullptr : entries_[front_].finisher;
}

/// Frees a place that is ready. Returns false when it is not.
bool Slot::release(Entry& entry) noexcept {
    if (!entry.is_ready()) return false;
    entry.state.store(State::free, std::memory_order_release);
    waiting_.fetch_sub(1, std::memory_order_relaxed);
    return true;
}

void Slot::pop() noexcept {
    if (front_ != count_) {
        release(entries_[front_]);
    }
    front_ = count_;
}

void Slot::clear() noexcept {
    for (std::size_t i = 0; waiting_.load(std::memory_order_acquire) != 0 && i < count_; ++i) {
        release(entries_[i]);
    }
}

}  // namespace hal::tdma
