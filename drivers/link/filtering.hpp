// SPDX-License-Identifier: MIT
// What the drivers that count and filter by themselves have in common.
#pragma once

#include <memory>
#include <vector>

#include "link/counting.hpp"

namespace hal::can {

/// The filters of one link: setup replaces them while the receiving thread looks at them.
class Filters {
public:
    void set(std::span<const Filter> filters) {  // [setup]
        kept_.push_back(std::make_unique<std::vector<Filter>>(filters.begin(), filters.end()));
        now_.store(kept_.back().get(), std::memory_order_release);
    }
    /// Whether any of them passes the frame; none: all pass. [realtime] receiver
    bool pass(const Frame& f) const noexcept {
        const auto* filters = now_.load(std::memory_order_acquire);
        if (filters == nullptr || filters->empty()) return true;
        for (const auto& filter : *filters)
            if (filter.matches(f)) return true;
        return false;
    }

private:
    std::atomic<const std::vector<Filter>*>           now_{nullptr};
    std::vector<std::unique_ptr<std::vector<Filter>>> kept_;  // a cycle may still look at an old one
};

/// A link with counters, filters and a description of its own.
class FilteringLink : public Link {
public:
    State state() const noexcept override { return counting_.state.load(std::memory_order_relaxed); }
    bool  set_filters(std::span<const Filter> filters) override {
        filters_.set(filters);
        return true;
    }
    const Description& description() const noexcept override { return description_; }

protected:
    Counting    counting_;
    Filters     filters_;
    Description description_;
};

}  // namespace hal::can
