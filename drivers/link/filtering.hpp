// SPDX-License-Identifier: MIT
// Filters, for drivers that count and filter in this process.
#pragma once

#include <memory>
#include <vector>

#include "link/counting.hpp"

namespace hal::can {

/// The filters of one link: setup replaces them while the receiving thread uses them.
class Filters {
public:
    /// Replaces the filters. [setup]
    void set(std::span<const Filter> filters) {
        kept_.push_back(std::make_unique<std::vector<Filter>>(filters.begin(), filters.end()));
        now_.store(kept_.back().get(), std::memory_order_release);
    }
    /// Returns true when any filter passes the frame, or without filters. [realtime] receiver
    bool pass(const Frame& f) const noexcept {
        const auto* filters = now_.load(std::memory_order_acquire);
        if (filters == nullptr || filters->empty()) return true;
        for (const auto& filter : *filters) {
            if (filter.matches(f)) return true;
        }
        return false;
    }

private:
    std::atomic<const std::vector<Filter>*> now_{nullptr};
    std::vector<std::unique_ptr<std::vector<Filter>>> kept_;  // a cycle may still use an old one
};

/// A link with its own counters, filters and description.
class FilteringLink : public Link {
public:
    State state() const noexcept override {
        return counting_.state.load(std::memory_order_relaxed);
    }
    bool set_filters(std::span<const Filter> filters) override {
        filters_.set(filters);
        return true;
    }
    const Description& description() const noexcept override { return description_; }

protected:
    Counting counting_;
    Filters filters_;
    Description description_;
};

}  // namespace hal::can
