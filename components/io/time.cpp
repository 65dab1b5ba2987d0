// SPDX-License-Identifier: MIT
#include <cstdint>

#include "hal/component.hpp"
#include "hal/edge.hpp"
#include "hal/retained.hpp"

namespace {

struct Time : hal::Component {
    using Component::Component;

    hal::In<bool> begin{*this, "start",
                        "a rising edge resets the time; TRUE runs it, FALSE holds it"};
    hal::In<bool> pause{*this, "pause", "TRUE holds the time"};
    hal::Out<std::uint32_t> seconds{*this, "seconds", "seconds, 0..59", {.unit = "s"}};
    hal::Out<std::uint32_t> minutes{*this, "minutes", "minutes, 0..59", {.unit = "min"}};
    hal::Out<std::uint32_t> hours{*this, "hours", "hours", {.unit = "h"}};

    hal::Function run{*this, "", &Time::update, "advances the time"};

    void update(hal::Cycle cycle) noexcept {
        const bool running = begin || pause;
        if (running_edge_.rises(running)) {
            elapsed_ns_ = 0;
        }
        if (!begin || pause) return;
        elapsed_ns_ += cycle.period_ns();
        const std::int64_t whole = elapsed_ns_ / 1'000'000'000;
        seconds = static_cast<std::uint32_t>(whole % 60);
        minutes = static_cast<std::uint32_t>(whole / 60 % 60);
        hours = static_cast<std::uint32_t>(whole / 3600);
    }

private:
    std::int64_t elapsed_ns_ = 0;
    hal::RisingEdge running_edge_;
    hal::Retained retained_{*this, {{"elapsed-ns", elapsed_ns_}, {"was-running", running_edge_}}};
};

}  // namespace

HAL_COMPONENT(Time, "time", "Elapsed time in hours, minutes and seconds", R"(
Counts the time for which `start` is TRUE and `pause` FALSE, from 0 when one of the two becomes TRUE
after both were FALSE. Otherwise the result is held. The time is a sum of periods, not read from a
clock: missed periods are not included.

    loadrt time
    addf time.0 servo-thread
    net running  => time.0.start
)")
