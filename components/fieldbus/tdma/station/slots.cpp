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
                ethernet::Finisher* finisher, std::uint32_t epoch) noexcept {
    if (frame.size() < ethernet::header_bytes ||
        frame.size() > ethernet::header_bytes + capacity() || frame.size() > ethernet::max_frame ||
        ahead_of(priority, epoch) + ethernet::wire_bytes(frame.size()) > turn_bytes()) {
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
        entry.epoch.store(epoch, std::memory_order_relaxed);
        entry.order = order_.fetch_add(1, std::memory_order_relaxed);
        entry.finisher = finisher;
        waiting_.fetch_add(1, std::memory_order_relaxed);  // before the entry is ready
        entry.state.store(State::ready, std::memory_order_release);
        return true;
    }
    return false;
}

std::size_t Slot::ahead_of(unsigned priority, std::uint32_t epoch) const noexcept {
    if (waiting() == 0) return 0;
    std::size_t bytes = 0;
    for (std::size_t i = 0; i < count_; ++i) {
        const Entry& entry = entries_[i];
        const bool counts = entry.is_ready() &&
                            entry.epoch.load(std::memory_order_relaxed) == epoch &&
                            entry.priority.load(std::memory_order_relaxed) <= priority;
        if (counts) {
            bytes += ethernet::wire_bytes(entry.length.load(std::memory_order_relaxed));
        }
    }
    return bytes;
}

/// Returns the index of the frame that leaves first; count_: none. Drops frames of earlier epochs.
std::size_t Slot::max_urgent() noexcept {
    if (waiting() == 0) return count_;
    // Returns the order of sending: smaller leaves first.
    const auto rank = [](const Entry& entry) {
        return std::pair(entry.priority.load(std::memory_order_relaxed), entry.order);
    };
    std::size_t best = count_;
    for (std::size_t i = 0; i < count_; ++i) {
        if (!entries_[i].is_ready()) continue;
        if (entries_[i].epoch.load(std::memory_order_relaxed) != epoch_) {
            drop(entries_[i]);
            continue;
        }
        if (best == count_ || rank(entries_[i]) < rank(entries_[best])) {
            best = i;
        }
    }
    return best;
}

std::span<const std::uint8_t> Slot::front() noexcept {
    front_ = max_urgent();
    if (front_ == count_) {
        return {};
    }
    const Entry& entry = entries_[front_];
    return {entry.bytes.data(), entry.length.load(std::memory_order_relaxed)};
}

ethernet::Finisher* Slot::finisher() const noexcept {
    return front_ == count_ ? nullptr : entries_[front_].finisher;
}

/// Frees an entry that is ready. Returns false when it is not.
bool Slot::release(Entry& entry) noexcept {
    if (!entry.is_ready()) return false;
    entry.state.store(State::free, std::memory_order_release);
    waiting_.fetch_sub(1, std::memory_order_relaxed);
    return true;
}

void Slot::drop(Entry& entry) noexcept {
    if (release(entry)) {
        ++dropped_;
    }
}

void Slot::pop() noexcept {
    if (front_ != count_) {
        release(entries_[front_]);
    }
    front_ = count_;
}

void Slot::clear(std::uint32_t epoch) noexcept {
    epoch_ = epoch;
    if (waiting() == 0) return;
    for (std::size_t i = 0; i < count_; ++i) {
        drop(entries_[i]);
    }
}

}  // namespace hal::tdma
