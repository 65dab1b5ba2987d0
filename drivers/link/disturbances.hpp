// SPDX-License-Identifier: MIT
// The faults injected on a bus in memory, and their random numbers, which are the same in each run.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace hal::link {

/// Random numbers of the generator splitmix64. [any] one thread at a time
class Random {
public:
    void seed(std::uint64_t value) noexcept { state_ = value; }
    std::uint64_t draw() noexcept {
        state_ += 0x9e3779b97f4a7c15U;
        std::uint64_t z = state_;
        z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9U;
        z = (z ^ z >> 27) * 0x94d049bb133111ebU;
        return z ^ z >> 31;
    }
    /// Returns true with a probability, 0..1.
    bool draw_bool(double probability) noexcept {
        return static_cast<double>(draw() >> 11) * 0x1p-53 < probability;
    }

private:
    std::uint64_t state_ = 1;
};

/// The disturbances of a bus, in the order of their numbers. One thread at a time uses them.
template <class Disturbance>
class Disturbances {
public:
    struct Active {
        Disturbance what;
        std::uint64_t matched = 0;
        std::uint64_t hits = 0;

        /// Returns true at a time at which it may still hit. [realtime]
        bool is_active(std::int64_t now_ns) const noexcept {
            return now_ns >= what.from_ns && now_ns < what.until_ns && hits < what.count;
        }
    };

    Disturbances() { all_.reserve(max_count); }

    /// Returns the number of the added disturbance, -1 when there are too many. [setup]
    int add(const Disturbance& what) {
        if (all_.size() >= max_count) return -1;
        all_.push_back({what, 0, 0});
        return static_cast<int>(all_.size()) - 1;
    }
    /// Returns how often a disturbance has hit; 0 for a number that does not exist. [setup]
    std::uint64_t hits(int number) const {
        const auto index = static_cast<std::size_t>(number);
        return number >= 0 && index < all_.size() ? all_[index].hits : 0;
    }
    void clear() noexcept { all_.clear(); }  ///< [setup]

    auto begin() noexcept { return all_.begin(); }
    auto end() noexcept { return all_.end(); }
    /// Counts a frame that matches. Returns whether the disturbance strikes it. [realtime]
    bool match(Active& disturbance) noexcept {
        ++disturbance.matched;
        const std::uint32_t every = disturbance.what.every;
        if (every != 0) return disturbance.matched % every == 0;
        return random.draw_bool(disturbance.what.probability);
    }

    Random random;

private:
    static constexpr std::size_t max_count = 64;
    std::vector<Active> all_;
};

}  // namespace hal::link
