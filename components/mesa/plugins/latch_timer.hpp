// SPDX-License-Identifier: MIT
// Which timer of the DPLL latches the values of a kind of module.
#pragma once

#include "mesa/hostmot2/registers.hpp"
#include "module_pins.hpp"

namespace hal::mesa {

class LatchTimer {
public:
    /// `name` and `doc` are those of its parameter, `address` is its register.
    LatchTimer(const PinOwner& o, const char* name, const char* doc, std::uint16_t address)
        : number_(o.component, name, doc, {.initial = -1}), select_(address) {}

    /// Returns the number of the timer, 0..4; others: none. [realtime]
    std::int32_t number() const noexcept { return number_; }
    /// [realtime] write
    void transmit(Outgoing& out) noexcept {
        const std::int32_t timer = number_;
        const bool is_on = timer >= 0 && timer <= 4;
        out.put(select_, is_on ? stepgen::dpll_select(static_cast<unsigned>(timer)) : 0);
    }

private:
    hal::Param<std::int32_t> number_;
    Setting select_;
};

}  // namespace hal::mesa
