// SPDX-License-Identifier: MIT
#include <cstdint>

#include "hal/component.hpp"
#include "hal/retained.hpp"
#include "run_time.hpp"

namespace {

struct Timedelta : hal::Component {
    using Component::Component;
    hal::Out<std::int32_t> jitter{*this, "jitter", "largest current-jitter so far", {.unit = "ns"}};
    hal::Out<std::int32_t> current_jitter{
        *this, "current-jitter", "magnitude of current-error", {.unit = "ns"}};
    hal::Out<std::int32_t> current_error{
        *this, "current-error", "out - period: positive when it ran late", {.unit = "ns"}};
    hal::Out<std::int32_t> min{*this, "min", "shortest time between two runs", {.unit = "ns"}};
    hal::Out<std::int32_t> max{*this, "max", "longest time between two runs", {.unit = "ns"}};
    hal::In<bool> reset{*this, "reset", "TRUE resets jitter, min, max, err and avg-err"};
    hal::Out<std::int32_t> out{*this, "out", "time since the last run", {.unit = "ns"}};
    hal::Out<std::int32_t> err{*this, "err", "sum of all errors", {.unit = "ns"}};
    hal::Out<double> average{*this, "avg-err", "mean of all errors", {.unit = "ns"}};
    hal::Function run{*this, "", &Timedelta::update, "measures the time since the last run"};

    void update(hal::Cycle cycle) noexcept {
        const std::int64_t since = time_.since_last(cycle);
        if (since < 0) {
            return;  // the first run
        }
        const std::int64_t error = since - cycle.period_ns();
        if (reset || runs_ == 0) {
            runs_ = 0;
            sum_ = worst_ = 0;
            shortest_ = max_ = since;
        }
        ++runs_;
        sum_ += error;
        worst_ = std::max(worst_, error < 0 ? -error : error);
        shortest_ = std::min(shortest_, since);
        max_ = std::max(max_, since);

        out = measure::to_s32(since);
        current_error = measure::to_s32(error);
        current_jitter = measure::to_s32(error < 0 ? -error : error);
        jitter = measure::to_s32(worst_);
        min = measure::to_s32(shortest_);
        max = measure::to_s32(max_);
        err = measure::to_s32(sum_);
        average = static_cast<double>(sum_) / static_cast<double>(runs_);
    }

private:
    measure::RunTime time_;
    std::int64_t runs_ = 0;
    std::int64_t sum_ = 0;
    std::int64_t worst_ = 0;
    std::int64_t shortest_ = 0;
    std::int64_t max_ = 0;
    hal::Retained retained_{*this,
                            {{"time", time_},
                             {"runs", runs_},
                             {"sum", sum_},
                             {"worst", worst_},
                             {"shortest", shortest_},
                             {"longest", max_}}};
};

}  // namespace

HAL_COMPONENT(Timedelta, "timedelta", "Measures how regularly a thread runs", R"(
Each run measures the time since the previous one; the error is its difference from the period. Add
it first in the thread to measure wake-ups, last to include the other functions. On a virtual clock
the errors are 0. `show thread` prints histograms of every thread without this component.

    loadrt timedelta names=wake
    addf wake servo 1
    net worst <= wake.jitter
)")
