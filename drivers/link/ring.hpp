// SPDX-License-Identifier: MIT
// The queue between one thread that puts frames in and one that takes them out. Neither waits; memory is taken when it is made.
#pragma once

#include <atomic>
#include <bit>
#include <cstddef>
#include <memory>

namespace hal::link {

/// `head_` counts what was put in, `tail_` what was taken out, both for ever; index = count & mask.
///   1. writer stores the item at head      2. writer publishes head + 1 (release)
///   3. reader sees head (acquire), copies   4. reader publishes tail + 1 (release)
/// The writer reuses a place only after 4, the reader looks at it only after 2.
template <class T>
class Ring {
public:
    /// Room for at least `capacity` items, at least 2 and at most 2^20. [setup]
    explicit Ring(std::size_t capacity)
        : mask_(std::bit_ceil(capacity < 2 ? std::size_t{2} : capacity > 1048576 ? std::size_t{1048576} : capacity) - 1),
          items_(std::make_unique<T[]>(mask_ + 1)) {}

    /// False, and nothing done, when full. [realtime] writer
    bool push(const T& item) noexcept {
        const auto head = head_.load(std::memory_order_relaxed);
        if (head - tail_.load(std::memory_order_acquire) > mask_) return false;
        items_[head & mask_] = item;
        head_.store(head + 1, std::memory_order_release);
        return true;
    }
    /// The place of the next item, to be filled and then put in by commit(), or nullptr when full: an item that is large and mostly
    /// empty is not copied whole. [realtime] writer
    T* place() noexcept {
        const auto head = head_.load(std::memory_order_relaxed);
        return head - tail_.load(std::memory_order_acquire) > mask_ ? nullptr : &items_[head & mask_];
    }
    void commit() noexcept { head_.store(head_.load(std::memory_order_relaxed) + 1, std::memory_order_release); }
    /// The oldest item, or nullptr; it stays until pop(). [realtime] reader
    T* front() noexcept { return at(0); }
    /// The item `n` behind the oldest, or nullptr. [realtime] reader
    T* at(std::size_t n) noexcept {
        const auto tail = tail_.load(std::memory_order_relaxed);
        return head_.load(std::memory_order_acquire) - tail > n ? &items_[(tail + n) & mask_] : nullptr;
    }
    /// Drops the oldest `count` items, which must be there. [realtime] reader
    void pop(std::size_t count = 1) noexcept { tail_.store(tail_.load(std::memory_order_relaxed) + count, std::memory_order_release); }
    /// Items waiting, as either side sees it. [any]
    std::size_t size() const noexcept {
        const auto tail = tail_.load(std::memory_order_acquire);  // first: otherwise the reader could overtake what was read as head
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
