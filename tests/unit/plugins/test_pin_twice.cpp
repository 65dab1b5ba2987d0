// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

struct PinTwice : hal::Component {
    using Component::Component;
    hal::In<bool> one{*this, "in", "first"};
    hal::In<bool> two{*this, "in", "second"};
};

HAL_COMPONENT(PinTwice, "test-pin-twice", "Declares one name for two pins")
