// SPDX-License-Identifier: MIT
#include <cstdint>

#include "hal/component.hpp"

namespace {

struct Time : hal::Component {
    using Component::Component;

    hal::In<bool> begin{*this, "start", "rising edge: from 0; while TRUE the time runs, while FALSE it stands"};
    hal::In<bool> pause{*this, "pause", "TRUE: the time stands"};
    hal::Out<std::uint32_t> seconds{*this, "seconds", "0 to 59", {.unit = "s"}};
    hal::Out<std::uint32_t> minutes{*this, "minutes", "0 to 59", {.unit = "min"}};
    hal::Out<std::uint32_t> hours{*this, "hours", "from 0", {.unit = "h"}};

    hal::Function run{*this, "", &Time::update, "lets the time run"};

    void update(hal::Cycle cycle) noexcept {
        if (begin && !began_) elapsed_ns_ = 0;
        else if (begin && !pause) elapsed_ns_ += cycle.period_ns();
        began_ = begin;
        const std::int64_t whole = elapsed_ns_ / 1'000'000'000;
        seconds = static_cast<std::uint32_t>(whole % 60);
        minutes = static_cast<std::uint32_t>(whole / 60 % 60);
        hours = static_cast<std::uint32_t>(whole / 3600);
    }

private:
    std::int64_t elapsed_ns_ = 0;
    bool began_ = false;
};

}  // namespace

HAL_COMPONENT(Time, "time", "Elapsed time in hours, minutes and seconds", R"(
Counts the time `start` has been TRUE since its last rising edge, without the time `pause` was TRUE. After `start` has gone
FALSE the result stays. Periods are added up, not clocks read: a missed period is missing.

    loadrt time
    addf time.0 servo-thread
    net running  => time.0.start
)")
