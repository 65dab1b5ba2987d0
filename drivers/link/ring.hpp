// SPDX-License-Identifier: MIT
// A queue between one writing and one reading thread. Neither waits; memory is allocated on construction.
#pragma once

#include <atomic>
#include <bit>
#include <cstddef>
#include <memory>

namespace hal::link {

/// `head_` counts the items written, `tail_` those read, without wrapping; index = count & mask.
///   1. writer stores the item at head      2. writer publishes head + 1 (release)
///   3. reader sees head (acquire), copies   4. reader publishes tail + 1 (release)
/// The writer reuses an entry only after 4, the reader accesses it only after 2.
template <class T>
class Ring {
public:
    /// Allocates space for at least `capacity` items, 2..2^20. [setup]
    explicit Ring(std::size_t capacity)
        : mask_(std::bit_ceil(capacity < 2 ? std::size_t{2} : capacity > 1048576 ? std::size_t{1048576} : capacity) - 1),
          items_(std::make_unique<T[]>(mask_ + 1)) {}

    /// Adds an item. Returns false when full. [realtime] writer
    bool push(const T& item) noexcept {
        const auto head = head_.load(std::memory_order_relaxed);
        if (head - tail_.load(std::memory_order_acquire) > mask_) return false;
        items_[head & mask_] = item;
        head_.store(head + 1, std::memory_order_release);
        return true;
    }
    /// Returns the entry of the next item, to be filled and then added by commit(), or nullptr when full: saves copying a large, mostly
    /// empty item. [realtime] writer
    T* place() noexcept {
        const auto head = head_.load(std::memory_order_relaxed);
        return head - tail_.load(std::memory_order_acquire) > mask_ ? nullptr : &items_[head & mask_];
    }
    /// Adds the item filled in place(). [realtime] writer
    void commit() noexcept { head_.store(head_.load(std::memory_order_relaxed) + 1, std::memory_order_release); }
    /// Returns the oldest item, valid until pop(), or nullptr. [realtime] reader
    T* front() noexcept { return at(0); }
    /// Returns the item `n` after the oldest, or nullptr. [realtime] reader
    T* at(std::size_t n) noexcept {
        const auto tail = tail_.load(std::memory_order_relaxed);
        return head_.load(std::memory_order_acquire) - tail > n ? &items_[(tail + n) & mask_] : nullptr;
    }
    /// Removes the oldest `count` items, which must exist. [realtime] reader
    void pop(std::size_t count = 1) noexcept { tail_.store(tail_.load(std::memory_order_relaxed) + count, std::memory_order_release); }
    /// Returns the number of items, as seen by either side. [any]
    std::size_t size() const noexcept {
        const auto tail = tail_.load(std::memory_order_acquire);  // read first, or the reader could overtake the head that was read
        return head_.load(std::memory_order_acquire) - tail;
    }
    std::size_t capacity() const noexcept { return mask_ + 1; }

private:
    const std::size_t mask_;
    std::unique_ptr<T[]> items_;
    alignas(64) std::atomic<std::size_t> head_{0};  // written by the writer
    alignas(64) std::atomic<std::size_t> tail_{0};  // written by the reader
};

}  // namespace hal::link
