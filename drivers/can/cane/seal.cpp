// SPDX-License-Identifier: MIT
#include "seal.hpp"

#include <algorithm>
#include <ctime>
#include <mutex>
#include <vector>

#include "link/system.hpp"

namespace hal::can::cane {

namespace {

/// Grows with every frame of this process, and from one start to the next unless the clock is set
/// back.
std::uint64_t next_counter(bool simulated) noexcept {
    static std::atomic<std::uint64_t> last{0};
    const auto clock =
        simulated ? std::uint64_t{0} : static_cast<std::uint64_t>(link::clock_ns(CLOCK_REALTIME));
    auto before = last.load(std::memory_order_relaxed);
    for (;;) {
        const auto next = std::max(before + 1, clock);
        if (last.compare_exchange_weak(before, next, std::memory_order_relaxed)) return next;
    }
}

ethernet::Address destination(std::span<const std::uint8_t> frame) noexcept {
    ethernet::Address to{};
    std::copy_n(frame.begin(), to.size(), to.begin());
    return to;
}

}  // namespace

void Seal::leaves(std::span<std::uint8_t> frame) noexcept {
    const auto sequence = sequences_of(frame).next(destination(frame));
    if (key_) {
        finish_packed(frame, sequence, next_counter(simulated_), &*key_);
    } else {
        finish_packed(frame, sequence, 0, nullptr);
    }
}

void Seal::stayed(std::span<const std::uint8_t> frame) noexcept {
    sequences_of(frame).give_back(destination(frame));
}

std::shared_ptr<Seal> Seal::take(const std::optional<Key>& key, bool simulated) {
    static std::mutex mutex;
    static std::vector<std::shared_ptr<Seal>> all;
    // frames wait for a few cycles at most, so the seal returned first has none waiting
    constexpr long kept = 64;
    const std::lock_guard lock(mutex);
    const auto is_free = [](const auto& s) { return s.use_count() == 1; };
    const auto oldest = std::find_if(all.begin(), all.end(), is_free);
    if (oldest == all.end() || std::count_if(all.begin(), all.end(), is_free) < kept) {
        all.push_back(std::make_shared<Seal>());
    } else {
        std::rotate(oldest, oldest + 1, all.end());
    }
    Seal& s = *all.back();
    s.process_.clear();
    s.service_.clear();
    s.key_ = key;
    s.simulated_ = simulated;
    return all.back();
}

}  // namespace hal::can::cane
