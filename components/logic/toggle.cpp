// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

namespace {

struct Toggle : hal::Component {
    using Component::Component;
    hal::In<bool>             in{*this, "in", "the button"};
    hal::Io<bool>             out{*this, "out", "turns over with each press; others may write it, too"};
    hal::Param<std::uint32_t> debounce{*this, "debounce", "cycles the button must hold its new state; 0 and 1: it counts at once",
                                       {.initial = 2}};
    hal::Function             run{*this, "", hal::step<&Toggle::update>, "reads the button"};

    void update(hal::Cycle) noexcept {
        if (in == pressed_) {
            held_ = 0;
        } else if (++held_ >= debounce) {
            held_ = 0;
            pressed_ = !pressed_;
            if (pressed_) out = !out;
        }
    }

private:
    bool pressed_ = false;    // the button without its bouncing
    std::uint32_t held_ = 0;  // cycles it has been other than that
};

}  // namespace

HAL_COMPONENT(Toggle, "toggle", "Push on, push off", R"(
A press that outlasts its bouncing by `debounce` cycles turns `out` over; so must the release before the next press counts. `out` is an
io pin: what others write into the signal is where the next press starts.

    loadrt toggle names=lamp-button
    addf lamp-button servo
    net button => lamp-button.in
    net lamp   <=> lamp-button.out
)")
