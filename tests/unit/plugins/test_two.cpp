// SPDX-License-Identifier: MIT
// Two functions that each have pins of their own, so they may run in two threads; one pin of both
// when asked for.
#include "hal/component.hpp"

namespace {

struct Two : hal::Component {
    using Component::Component;
    hal::Argument common{*this, "common", 0, "1: one more pin, of both functions"};
    hal::Function fast{*this, "fast", &Two::run_fast, "counts up two pins"};
    hal::Out<std::uint64_t> a{*this, fast, "a", "runs of fast"};
    hal::Out<std::uint64_t> b{*this, fast, "b", "the same"};
    hal::Function first{*this, "first", &Two::run_first, "reads"};
    hal::In<std::uint64_t> a_in{*this, first, "a-in", "linked to an a"};
    hal::In<std::uint64_t> b_in{*this, first, "b-in", "linked to the b of the same instance"};
    hal::Function last{*this, "last", &Two::run_last, "reads again"};
    hal::In<std::uint64_t> a_again{*this, last, "a-again", "the same a"};
    hal::In<std::uint64_t> b_again{*this, last, "b-again", "the same b"};
    hal::Out<std::uint64_t> looks{*this, last, "looks", "runs of last"};
    hal::Out<std::uint64_t> torn{*this, last, "torn",
                                 "runs in which what was read did not fit together"};
    hal::Ins<bool> both{*this, "both-#", common, "used by all functions"};

    void run_fast(hal::Cycle) noexcept {
        a = a + 1;
        b = b + 1;
    }
    void run_first(hal::Cycle) noexcept {
        a_seen_ = a_in;
        b_seen_ = b_in;
    }
    void run_last(hal::Cycle) noexcept {  // in the same thread as first
        looks = looks + 1;
        if (a_seen_ != b_seen_ || a_again != a_seen_ || b_again != b_seen_) {
            torn = torn + 1;
        }
    }

private:
    std::uint64_t a_seen_ = 0;

private:
    std::uint64_t b_seen_ = 0;
};

}  // namespace

HAL_COMPONENT(Two, "test-two", "Functions for two threads")
