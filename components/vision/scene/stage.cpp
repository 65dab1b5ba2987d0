// SPDX-License-Identifier: MIT
#include "vision/scene/stage.hpp"

#include <algorithm>
#include <map>
#include <mutex>
#include <stdexcept>

namespace hal::vision::scene {

void Stage::put(std::int64_t stamp_ns, std::span<const double> values) noexcept {
    const std::uint64_t n = count_.load(std::memory_order_relaxed);
    Slot& slot = (*slots_)[n % kept];
    slot.number.store(2 * n + 1, std::memory_order_relaxed);
    // who sees this or a value sees the odd number too
    slot.stamp.store(stamp_ns, std::memory_order_release);
    for (std::size_t i = 0; i < std::min(values.size(), max_values); ++i) {
        slot.values[i].store(values[i], std::memory_order_release);
    }
    slot.number.store(2 * n + 2, std::memory_order_release);
    count_.store(n + 1, std::memory_order_release);
}

bool Stage::read(std::uint64_t n, State& to) const noexcept {
    const Slot& slot = (*slots_)[n % kept];
    if (slot.number.load(std::memory_order_acquire) != 2 * n + 2) return false;
    to.stamp_ns = slot.stamp.load(std::memory_order_acquire);
    for (std::size_t i = 0; i < max_values; ++i) {
        to.values[i] = slot.values[i].load(std::memory_order_acquire);
    }
    return slot.number.load(std::memory_order_relaxed) == 2 * n + 2;
}

bool Stage::newest(State& to) const noexcept {
    for (int tries = 0; tries < 4; ++tries) {
        if (const std::uint64_t n = count_.load(std::memory_order_acquire); n == 0) {
            return false;
        } else if (read(n - 1, to)) {
            return true;
        }
    }
    return false;
}

bool Stage::when(std::int64_t stamp_ns, State& to) const noexcept {
    State after;
    const std::uint64_t count = count_.load(std::memory_order_acquire);
    if (count == 0 || !read(count - 1, to)) return false;
    if (to.stamp_ns <= stamp_ns) return true;
    const auto stamp = [this](std::uint64_t n) {
        return (*slots_)[n % kept].stamp.load(std::memory_order_relaxed);
    };
    // the stamps grow with the number: halve what is kept, less what the writer may be at
    std::uint64_t late = count - 1, early = count > kept - 8 ? count - (kept - 8) : 0;
    if (stamp(early) > stamp_ns) return read(early, to);
    while (late - early > 1) {
        const std::uint64_t middle = early + (late - early) / 2;
        (stamp(middle) > stamp_ns ? late : early) = middle;
    }
    if (!read(late, after) || !read(early, to) || after.stamp_ns <= to.stamp_ns) {
        return read(late, to);
    }
    const double part = std::clamp(static_cast<double>(stamp_ns - to.stamp_ns) /
                                       static_cast<double>(after.stamp_ns - to.stamp_ns),
                                   0.0, 1.0);
    for (std::size_t i = at::poses; i < at::poses + at::smooth; ++i) {
        to.values[i] += part * (after.values[i] - to.values[i]);
    }
    to.stamp_ns = stamp_ns;
    return true;
}

namespace {
std::mutex mutex;
std::map<std::string, std::shared_ptr<Stage>> stages;
}  // namespace

void open(const std::string& name, std::shared_ptr<Stage> stage) {
    const std::lock_guard lock(mutex);
    if (!stages.emplace(name, std::move(stage)).second) {
        throw std::invalid_argument("duplicate scene sim:" + name +
                                    "; use another name in camera=");
    }
}

void close(const std::string& name) noexcept {
    const std::lock_guard lock(mutex);
    stages.erase(name);
}

std::shared_ptr<const Stage> find(const std::string& name) {
    const std::lock_guard lock(mutex);
    const auto found = stages.find(name);
    return found == stages.end() ? nullptr : found->second;
}

}  // namespace hal::vision::scene
