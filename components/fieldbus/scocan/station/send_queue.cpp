// SPDX-License-Identifier: MIT
#include "send_queue.hpp"

#include "link/timing.hpp"

namespace hal::scocan {

bool SendQueue::push(const can::Frame& frame, std::uint32_t slot, bool priv, bool state) noexcept {
    if (state) {
        for (std::size_t i = 0; i < size_; ++i) {
            Entry& e = entries_[i];
            if (!e.state || e.in_flight || e.frame.id != frame.id) continue;
            e.frame = frame;
            return true;
        }
    }
    if (size_ == capacity) return false;
    const auto rank = can::arbitration_rank(frame);
    std::size_t at = size_++;
    for (; at > 0 && can::arbitration_rank(entries_[at - 1].frame) > rank; --at) {
        entries_[at] = entries_[at - 1];
    }
    entries_[at] = {frame, slot, priv, state, false, 0, 0};
    return true;
}

void SendQueue::remove(std::size_t index) noexcept {
    for (--size_; index < size_; ++index) {
        entries_[index] = entries_[index + 1];
    }
}

void SendQueue::withdraw(std::uint32_t id) noexcept {
    for (std::size_t i = size_; i-- > 0;) {
        if (entries_[i].state && !entries_[i].in_flight && entries_[i].frame.id == id) {
            remove(i);
        }
    }
}

std::size_t SendQueue::drop_waiting(std::uint32_t limit) noexcept {
    const std::size_t before = size_;
    for (std::size_t i = size_; i-- > 0;) {
        if (!entries_[i].in_flight && entries_[i].frame.id < limit) {
            remove(i);
        }
    }
    return before - size_;
}

SendQueue::Entry* SendQueue::handed_over(std::uint32_t id, Time planned) noexcept {
    for (std::size_t i = size_; i-- > 0;) {
        Entry& e = entries_[i];
        if (e.in_flight && e.priv && e.state && e.frame.id == id && e.planned == planned) return &e;
    }
    return nullptr;
}

bool SendQueue::confirm(const can::Frame& echo, Entry& sent) noexcept {
    for (std::size_t i = 0; i < size_; ++i) {
        if (!entries_[i].in_flight || !entries_[i].frame.same(echo)) continue;
        sent = entries_[i];
        remove(i);
        return true;
    }
    return false;
}

std::uint32_t SendQueue::expire(Time now) noexcept {
    std::uint32_t missed = 0;
    for (std::size_t i = size_; i-- > 0;) {
        Entry& e = entries_[i];
        if (!e.in_flight || now < e.until) continue;
        e.in_flight = false;
        if (!e.priv) continue;
        ++missed;
        // A value that was replaced while it was in flight is old.
        for (std::size_t k = 0; k < size_; ++k) {
            if (k != i && e.state && entries_[k].state && entries_[k].frame.id == e.frame.id) {
                remove(i);
                break;
            }
        }
    }
    return missed;
}

bool SendQueue::flying() const noexcept {
    for (std::size_t i = 0; i < size_; ++i) {
        if (entries_[i].in_flight) return true;
    }
    return false;
}

}  // namespace hal::scocan
