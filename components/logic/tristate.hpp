// SPDX-License-Identifier: MIT
// tristate_bit and tristate_float.
#pragma once

#include "hal/component.hpp"

template <class T>
struct Tristate : hal::Component {
    using Component::Component;
    hal::In<T> in{*this, "in", "value to write"};
    hal::Io<T> out{*this, "out", "set to in while enable is TRUE; not written otherwise"};
    hal::In<bool> enable{*this, "enable", "TRUE writes in to out"};
    hal::Function run{*this, "", hal::step<&Tristate::update>, "writes the value"};

    void update(hal::Cycle) noexcept {
        if (enable) {
            out = in.get();
        }
    }
};
