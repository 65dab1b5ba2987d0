// SPDX-License-Identifier: MIT
#include "hal/component.hpp"
#include "hal/retained.hpp"

namespace {

struct Momentary2nist : hal::Component {
    using Component::Component;
    hal::In<bool> in{*this, "in", "button; a rising edge is a request"};
    hal::In<bool> is_on{*this, "is-on", "feedback of the device: TRUE while it is on"};
    hal::Out<bool> on{*this, "on", "request to switch on, until is-on is TRUE"};
    hal::Out<bool> off{*this, "off", "request to switch off, until is-on is FALSE"};
    hal::In<std::uint32_t> debounce{
        *this,
        "debounce",
        "cycles for which a change of in must be stable; 0 and 1: immediate",
        {.initial = 2}};
    hal::In<std::uint32_t> timeout{*this,
                                   "max-pulse-length",
                                   "timeout of a request in cycles; 0: no timeout",
                                   {.initial = 1000}};
    hal::Function run{*this, "", hal::step<&Momentary2nist::update>,
                      "reads the button and the device"};

    void update(hal::Cycle) noexcept {
        if (on && (is_on || expired())) {
            on = false;
        }
        if (off && (!is_on || expired())) {
            off = false;
        }
        pulse_ += pulse_ < UINT32_MAX ? 1 : 0;
        if (!changed() || !stable_) return;
        on = !is_on;
        off = is_on;
        pulse_ = 1;
    }

private:
    bool expired() const { return timeout != 0 && pulse_ >= timeout; }

    /// True in the cycle in which a new state of the button has been stable for the debounce time.
    bool changed() {
        held_ = in == stable_ ? 0 : held_ + 1;
        if (held_ == 0 || held_ < debounce) return false;
        stable_ = !stable_;
        held_ = 0;
        return true;
    }

    std::uint32_t held_ = 0;  // cycles for which in has differed from stable_
    std::uint32_t pulse_ = 0;  // cycles for which on or off has been TRUE
    bool stable_ = false;
    hal::Retained retained_{*this, {{"held", held_}, {"pulse", pulse_}, {"stable", stable_}}};
};

}  // namespace

HAL_COMPONENT(Momentary2nist, "momentary2nist",
              "Push button for a device with inputs to switch on and off", R"(
Each press (rising edge of `in`) requests the other state of the device: `on` is TRUE until `is-on`
is TRUE, or `off` is TRUE until `is-on` is FALSE. If the device does not follow within
`max-pulse-length` cycles, the request ends.

    loadrt momentary2nist names=power
    addf power servo
    net power-button     => power.in
    net machine-is-on    => power.is-on
    net machine-turn-on  <= power.on
    net machine-turn-off <= power.off
)")
