// SPDX-License-Identifier: MIT
#include "hal/component.hpp"
#include "hal/retained.hpp"

namespace {

struct Toggle2nist : hal::Component {
    using Component::Component;
    hal::In<bool> in{*this, "in", "switch: a rising edge requests on, a falling edge off"};
    hal::In<bool> is_on{*this, "is-on", "feedback of the device: TRUE while it is on"};
    hal::Out<bool> on{*this, "on", "request to switch on, until is-on is TRUE"};
    hal::Out<bool> off{*this, "off", "request to switch off, until is-on is FALSE"};
    hal::In<std::uint32_t> debounce{
        *this,
        "debounce",
        "cycles for which a change of in must be stable, 1..10000; other values count as 2",
        {.initial = 2}};
    hal::In<std::uint32_t> timeout{
        *this, "max-pulse-length", "timeout of a request in cycles", {.initial = 100}};
    hal::Function run{*this, "", hal::step<&Toggle2nist::update>,
                      "reads the button and the device"};

    void update(hal::Cycle) noexcept {
        if (in != state_) {
            ++held_;
            if (held_ < stable_cycles()) return;
            held_ = 0;
            state_ = in;
            if (is_on != state_) {
                request(state_);
            }
            return;
        }
        held_ = 0;
        const bool followed = on ? is_on.get() : !is_on;
        const bool expired = age_ > timeout;
        if ((on || off) && (followed || expired)) {
            on = false;
            off = false;
        }
        ++age_;
    }

private:
    std::uint32_t stable_cycles() const noexcept {
        const std::uint32_t cycles = debounce;
        return cycles < 1 || cycles > 10'000 ? 2 : cycles;
    }

    void request(bool wanted) noexcept {
        on = wanted;
        off = !wanted;
        age_ = 0;
    }

    bool state_ = false;      // debounced state of the switch
    std::uint32_t held_ = 0;  // cycles for which the switch has differed from state_
    std::uint64_t age_ = 0;   // cycles since the last request
    hal::Retained retained_{*this, {{"state", state_}, {"held", held_}, {"age", age_}}};
};

}  // namespace

HAL_COMPONENT(Toggle2nist, "toggle2nist", "Switch for a device with inputs to switch on and off",
              R"(
A rising edge of `in` while the device is off requests `on` until `is-on` is TRUE; a falling edge
while it is on requests `off` until `is-on` is FALSE. If the device does not follow within
`max-pulse-length` cycles, the request ends. For a button that is TRUE while pressed use
`momentary2nist`.

**Differences from LinuxCNC:** This is the component of 2.10. In 2.9 both edges request the other
state of the device, there is no `debounce` and no `max-pulse-length`. In 2.10 the time of
`max-pulse-length` is not that of the request: it runs all the time, so a request can end after one
cycle.

    loadrt toggle2nist names=power
    addf power servo
    net power-switch     => power.in
    net machine-is-on    => power.is-on
    net machine-turn-on  <= power.on
    net machine-turn-off <= power.off
)")
