// SPDX-License-Identifier: MIT
#include <array>
#include <cmath>
#include <numbers>

#include "hal/component.hpp"
#include "hal/retained.hpp"

namespace {

struct EchoRange : hal::Component {
    using Component::Component;
    static constexpr std::uint32_t per_message = 8;
    static constexpr std::uint32_t messages = 32;

    hal::In<bool> begins{*this, "begins", "TRUE: a burst begins, with step"};
    hal::In<std::uint32_t> step{*this, "step", "position of the head in this burst"};
    hal::In<bool> fresh{*this, "new", "TRUE: a message of the burst arrived"};
    hal::In<std::uint32_t> id_offset{*this, "id-offset", "number of the message, modulo 8"};
    hal::Ins<std::uint32_t> sample{*this, "sample-#", per_message, "sample # of the message"};
    hal::Param<std::uint32_t> threshold{
        *this, "threshold", "smallest amplitude of an echo", {.initial = 16}};
    hal::Param<double> sample_length{
        *this, "sample-length", "distance of two samples", {.initial = 0.01715, .unit = "m"}};
    hal::Param<double> pause{*this,
                             "pause",
                             "time without a message that ends a burst",
                             {.initial = 0.005, .unit = "s"}};
    hal::Param<std::uint32_t> steps{
        *this, "steps", "positions of the head per turn", {.initial = 200}};

    hal::Out<double> range{*this,
                           "range",
                           "distance of the nearest echo of the newest burst; 1000: none",
                           {.unit = "m"}};
    hal::Out<double> bearing{*this,
                             "bearing",
                             "direction of the head in that burst, to the left of the heading",
                             {.unit = "rad"}};
    hal::Out<bool> range_new{*this, "range-new", "TRUE for the cycle in which a burst is complete"};
    hal::Out<std::uint32_t> bursts{*this, "bursts", "complete bursts"};
    hal::Out<std::uint32_t> incomplete{*this, "incomplete",
                                       "bursts with a missing or repeated message"};

    hal::Function run{*this, "update", &EchoRange::update, "takes the new message"};

    void update(hal::Cycle cycle) noexcept {
        range_new = false;
        if (!begins && !fresh) return;
        // The bus sends what waits in order of identifiers, so messages of a burst may overtake
        // each other and their announcement, but not those of the same identifier. A pause ends a
        // burst.
        if (begun_ && 1e-9 * static_cast<double>(cycle.start_ns() - newest_ns_) > pause) {
            begin();
        }
        newest_ns_ = cycle.start_ns();
        begun_ = true;
        if (begins) {
            announced_ = true;
            step_ = step;
        }
        if (fresh && id_offset < per_message && got_[id_offset] < messages / per_message) {
            take(id_offset);
        }
        if (!announced_ || count_ < messages) return;
        range = found_ < 0 ? 1000.0 : static_cast<double>(found_) * sample_length;
        bearing = std::remainder(2 * std::numbers::pi * step_ / std::max<std::uint32_t>(steps, 1),
                                 2 * std::numbers::pi);
        range_new = true;
        bursts = bursts + 1;
        count_ = 0;
        announced_ = false;
        begin();
    }

private:
    void begin() noexcept {
        if (count_ != 0 || announced_) {
            incomplete = incomplete + 1;
        }
        count_ = 0;
        got_.fill(0);
        announced_ = false;
        found_ = -1;
    }
    void take(std::uint32_t number) noexcept {
        const std::int64_t first =
            (std::int64_t{got_[number]++} * per_message + number) * per_message;
        ++count_;
        for (std::uint32_t i = 0; i < per_message; ++i) {
            if (sample[i] >= threshold && (found_ < 0 || first + i < found_)) {
                found_ = first + i;
            }
        }
    }

    std::array<std::uint32_t, per_message> got_{};
    std::int64_t found_ = -1;
    std::int64_t newest_ns_ = 0;
    std::uint32_t step_ = 0;
    std::uint32_t count_ = 0;
    bool begun_ = false;
    bool announced_ = false;
    hal::Retained retained_{*this,
                            {{"got", got_},
                             {"found", found_},
                             {"newest-ns", newest_ns_},
                             {"step", step_},
                             {"count", count_},
                             {"begun", begun_},
                             {"announced", announced_}}};
};

}  // namespace

HAL_COMPONENT(EchoRange, "echo_range", "Distance of the nearest echo in a burst of messages", R"(
An ultrasonic head reports an echo in 32 messages of eight samples; their number modulo 8 is in the
identifier. The distance is that of the first sample of at least `threshold`. Messages may overtake
each other on a bus that sorts them by identifier, but not those of the same identifier. A burst
with a message missing is counted in `incomplete` and gives no range.

    loadrt echo_range names=echo
    addf echo.update servo
    net burst-begins => echo.begins
    net part-arrived => echo.new
    net part         => echo.id-offset
    net amplitude0   => echo.sample-0
    net obstacle     <= echo.range
)")
