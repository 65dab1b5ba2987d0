// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <atomic>
#include <bit>
#include <cstdint>

namespace hal {

/// Durations in ns, in buckets 1/8 of a power of two wide (12 % resolution from 8 ns to 18 minutes,
/// exact below 8 ns). One writer [realtime], any readers [any].
class Histogram {
public:
    static constexpr std::size_t buckets = 8 + 8 * 37;

    void add(std::int64_t ns) noexcept {
        const auto value = static_cast<std::uint64_t>(ns < 0 ? 0 : ns);
        bump(counts_[index(value)]);
        if (value > max_.load(std::memory_order_relaxed)) {
            max_.store(value, std::memory_order_relaxed);
        }
    }
    std::uint64_t samples() const noexcept {
        std::uint64_t total = 0;
        for (const auto& c : counts_) {
            total += c.load(std::memory_order_relaxed);
        }
        return total;
    }
    std::uint64_t max_ns() const noexcept { return max_.load(std::memory_order_relaxed); }
    std::uint64_t count(std::size_t bucket) const noexcept {
        return counts_[bucket].load(std::memory_order_relaxed);
    }
    /// Returns the lower edge of a bucket, ns.
    static std::uint64_t edge(std::size_t bucket) noexcept {
        if (bucket < 8) return bucket;
        const auto octave = (bucket - 8) / 8;
        return std::uint64_t{8 + (bucket - 8) % 8} << octave;
    }
    /// Returns the quantile `share` (0 to 1) of all samples, interpolated within its bucket.
    double quantile(double share) const noexcept {
        const std::uint64_t total = samples();
        if (total == 0) return 0.0;
        const double wanted = share * static_cast<double>(total);
        double seen = 0.0;
        for (std::size_t i = 0; i < buckets; ++i) {
            const auto here = static_cast<double>(count(i));
            if (here > 0.0 && seen + here >= wanted) {
                const auto low = static_cast<double>(edge(i));
                const auto high = i + 1 < buckets ? static_cast<double>(edge(i + 1)) : low;
                const double value = low + (high - low) * (wanted - seen) / here;
                return value < static_cast<double>(max_ns()) ? value
                                                             : static_cast<double>(max_ns());
            }
            seen += here;
        }
        return static_cast<double>(max_ns());
    }

private:
    static std::size_t index(std::uint64_t value) noexcept {
        if (value < 8) return static_cast<std::size_t>(value);
        const auto octave = static_cast<std::size_t>(std::bit_width(value)) - 4;
        const auto i = 8 + octave * 8 + static_cast<std::size_t>((value >> octave) & 7);
        return i < buckets ? i : buckets - 1;
    }
    static void bump(std::atomic<std::uint64_t>& c) noexcept {
        c.store(c.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
    }

    std::array<std::atomic<std::uint64_t>, buckets> counts_{};
    std::atomic<std::uint64_t> max_{0};
};

}  // namespace hal
