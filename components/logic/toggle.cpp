// SPDX-License-Identifier: MIT
#include "hal/component.hpp"
#include "hal/corrected.hpp"
#include "hal/retained.hpp"

namespace {

struct Toggle : hal::Component {
    using Component::Component;
    hal::In<bool> in{*this, "in", "button"};
    hal::Io<bool> out{*this, "out", "inverted by each press; other components may write it, too"};
    hal::CorrectedParam<std::uint32_t> debounce{
        *this,
        "debounce",
        "cycles for which a new state of the button must be stable, 1..10000",
        {.initial = 2}};
    hal::Function run{*this, "", hal::step<&Toggle::update>, "reads the button and toggles out"};

    void update(hal::Cycle) noexcept {
        if (debounce < 1 || debounce > 10'000) {
            debounce.correct(2);
        }
        if (!in) {
            if (count_ > 0) {
                --count_;
            }
            if (count_ == 0) {
                pressed_ = false;
            }
            return;
        }
        count_ = std::min(count_ + 1, debounce.get());
        if (count_ < debounce) return;
        if (!pressed_) {
            out = !out;
        }
        pressed_ = true;
    }

private:
    bool pressed_ = false;     // debounced state of the button
    // cycles in which in was TRUE, minus those in which it was not: 0 to debounce
    std::uint32_t count_ = 0;
    hal::Retained retained_{*this, {{"pressed", pressed_}, {"count", count_}}};
};

}  // namespace

HAL_COMPONENT(Toggle, "toggle", "Push on, push off", R"(
A press that is stable for `debounce` cycles inverts `out`; the release must be stable as long
before the next press counts. While the button bounces, the cycles in which it is pressed count up
and the others count down. A `debounce` of 0 or above 10000 is set to 2. `out` is an io pin: the
next press inverts the value of the signal, even if another component wrote it.

    loadrt toggle names=lamp-button
    addf lamp-button servo
    net button => lamp-button.in
    net lamp   <=> lamp-button.out
)")
