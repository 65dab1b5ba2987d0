// SPDX-License-Identifier: MIT
#include "hal/component.hpp"
#include "hal/retained.hpp"

namespace {

struct Dbounce : hal::Component {
    using Component::Component;
    hal::In<bool> in{*this, "in", "noisy input"};
    hal::Out<bool> out{*this, "out", "debounced input"};
    hal::In<std::uint32_t> delay{
        *this,
        "delay",
        "cycles for which the input must be stable after a change; 0 copies in to out",
        {.initial = 5}};
    hal::Function run{*this, "", hal::step<&Dbounce::update>, "samples the input"};

    void update(hal::Cycle) noexcept {
        const bool level = in;
        const bool settled = level ? count_ >= delay : count_ == 0;
        if (settled) {
            out = level;
        } else {
            count_ += level ? 1 : -1;
        }
    }

private:
    // cycles in which in was TRUE, minus those in which it was not: 0 to delay
    std::uint32_t count_ = 0;
    hal::Retained retained_{*this, {{"count", count_}}};
};

}  // namespace

HAL_COMPONENT(Dbounce, "dbounce", "Filters a noisy digital input", R"(
`out` follows `in` once it has been stable for `delay` cycles after the cycle of the change. While
it bounces, cycles with the new state count up and cycles with the old state count down, as in
`debounce`. Unlike `debounce` it has a delay pin for each input.

    loadrt dbounce names=home-filter
    addf home-filter servo
    setp home-filter.delay 10
    net home-raw    => home-filter.in
    net home-switch <= home-filter.out
)")
