// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

namespace {

struct Toggle : hal::Component {
    using Component::Component;
    hal::In<bool>             in{*this, "in", "button"};
    hal::Io<bool>             out{*this, "out", "inverted by each press; other components may write it, too"};
    hal::Param<std::uint32_t> debounce{*this, "debounce", "cycles for which a new state of the button must be stable; 0 and 1: immediate",
                                       {.initial = 2}};
    hal::Function             run{*this, "", hal::step<&Toggle::update>, "reads the button and toggles out"};

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
    bool pressed_ = false;    // debounced state of the button
    std::uint32_t held_ = 0;  // cycles for which in has differed from it
};

}  // namespace

HAL_COMPONENT(Toggle, "toggle", "Push on, push off", R"(
A press that is stable for `debounce` cycles inverts `out`; the release must be stable as long before the next press counts. `out` is an
io pin: the next press inverts the value of the signal, even if another component wrote it.

    loadrt toggle names=lamp-button
    addf lamp-button servo
    net button => lamp-button.in
    net lamp   <=> lamp-button.out
)")
