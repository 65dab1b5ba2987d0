// SPDX-License-Identifier: MIT
// tristate_bit and tristate_float.
#pragma once

#include "hal/component.hpp"

template <class T>
struct Tristate : hal::Component {
    using Component::Component;
    hal::In<T>    in{*this, "in", "the value to place"};
    hal::Io<T>    out{*this, "out", "takes in while enable is TRUE; left alone otherwise"};
    hal::In<bool> enable{*this, "enable", "TRUE: in goes to out"};
    hal::Function run{*this, "", hal::step<&Tristate::update>, "places the value"};

    void update(hal::Cycle) noexcept {
        if (enable) out = in.get();
    }
};
