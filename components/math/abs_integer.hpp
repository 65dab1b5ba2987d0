// SPDX-License-Identifier: MIT
// abs_s32 and abs_s64.
#pragma once

#include <limits>

#include "hal/component.hpp"

template <class T>
struct AbsInteger : hal::Component {
    using Component::Component;
    hal::In<T> in{*this, "in", "input"};
    hal::Out<T> out{*this, "out", "absolute value of the input"};
    hal::Out<bool> sign{*this, "sign", "TRUE while in is negative"};
    hal::Out<bool> is_positive{*this, "is-positive", "TRUE while in is above 0"};
    hal::Out<bool> is_negative{*this, "is-negative", "TRUE while in is below 0"};
    hal::Function run{*this, "", hal::step<&AbsInteger::update>,
                      "computes the absolute value and the sign"};

    void update(hal::Cycle) noexcept {
        const T value = in;
        if (value >= 0) {
            out = value;
        } else if (value > std::numeric_limits<T>::min()) {
            out = -value;
        } else {
            out = std::numeric_limits<T>::max();
        }
        sign = value < 0;
        is_positive = value > 0;
        is_negative = value < 0;
    }
};
