// SPDX-License-Identifier: MIT
// The version before test_reload_new.
#include "hal/component.hpp"

namespace {

struct Old : hal::Component {
    using Component::Component;
    hal::Out<double> out{*this, "out", "1"};
    hal::Param<double> gone{*this, "gone", "is not in the new version"};
    hal::Function run{*this, "", &Old::update, "counts"};
    void update(hal::Cycle) noexcept { out = 1.0; }
};

}  // namespace

HAL_COMPONENT(Old, "test-reload", "The version before")
