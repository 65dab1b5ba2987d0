// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

struct FunctionBelow : hal::Component {
    using Component::Component;
    hal::In<bool> in{*this, run, "in", "names a member that does not exist yet"};
    hal::Function run{*this, "", &FunctionBelow::nothing, "nothing"};
    void nothing(hal::Cycle) noexcept {}
};

HAL_COMPONENT(FunctionBelow, "test-function-below", "A pin of a function that is declared below it")
