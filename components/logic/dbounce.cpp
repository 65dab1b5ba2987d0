// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

namespace {

struct Dbounce : hal::Component {
    using Component::Component;
    hal::In<bool>          in{*this, "in", "noisy input"};
    hal::Out<bool>         out{*this, "out", "the last stable input"};
    hal::In<std::uint32_t> delay{*this, "delay", "cycles the input must hold after its change; 0: out is in", {.initial = 5}};
    hal::Function          run{*this, "", hal::step<&Dbounce::update>, "samples the input"};

    void update(hal::Cycle) noexcept {
        if (in == out) differs_ -= differs_ > 0 ? 1 : 0;
        else if (++differs_ > delay) {
            out = in.get();
            differs_ = 0;
        }
    }

private:
    std::uint32_t differs_ = 0;  // cycles in which in was not out, less those in which it was
};

}  // namespace

HAL_COMPONENT(Dbounce, "dbounce", "Filters a noisy digital input", R"(
`out` follows `in` when it has held for `delay` cycles after the one in which it changed. While it bounces, cycles with the new state
count up and those with the old one down. Unlike `debounce` it has a delay pin for each input.

    loadrt dbounce names=home-filter
    addf home-filter servo
    setp home-filter.delay 10
    net home-raw    => home-filter.in
    net home-switch <= home-filter.out
)")
