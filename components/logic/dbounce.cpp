// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

namespace {

struct Dbounce : hal::Component {
    using Component::Component;
    hal::In<bool>          in{*this, "in", "noisy input"};
    hal::Out<bool>         out{*this, "out", "debounced input"};
    hal::In<std::uint32_t> delay{*this, "delay", "cycles for which the input must be stable after a change; 0 copies in to out", {.initial = 5}};
    hal::Function          run{*this, "", hal::step<&Dbounce::update>, "samples the input"};

    void update(hal::Cycle) noexcept {
        if (in == out) differs_ -= differs_ > 0 ? 1 : 0;
        else if (++differs_ > delay) {
            out = in.get();
            differs_ = 0;
        }
    }

private:
    std::uint32_t differs_ = 0;  // cycles in which in differed from out, minus those in which it did not
};

}  // namespace

HAL_COMPONENT(Dbounce, "dbounce", "Filters a noisy digital input", R"(
`out` follows `in` once it has been stable for `delay` cycles after the cycle of the change. While it bounces, cycles with the new state
count up and cycles with the old state count down. Unlike `debounce` it has a delay pin for each input.

    loadrt dbounce names=home-filter
    addf home-filter servo
    setp home-filter.delay 10
    net home-raw    => home-filter.in
    net home-switch <= home-filter.out
)")
