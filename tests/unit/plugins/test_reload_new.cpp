// SPDX-License-Identifier: MIT
// What comes in the place of test_reload_old: its output has another type, a parameter is gone.
#include "hal/component.hpp"

namespace {

struct New : hal::Component {
    using Component::Component;
    hal::Out<std::int32_t> out{*this, "out", "2"};
    hal::Function run{*this, "", &New::update, "counts"};
    void update(hal::Cycle) noexcept { out = 2; }
};

}  // namespace

HAL_COMPONENT(New, "test-reload", "The version after")
