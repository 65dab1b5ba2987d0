// SPDX-License-Identifier: MIT
// Computes for a while in each cycle, so that other threads run meanwhile.
#include "hal/component.hpp"

namespace {

struct Lengthy : hal::Component {
    using Component::Component;
    hal::Argument turns{*this, "turns", 200'000, "how long, in turns of a loop"};
    hal::Function run{*this, "", &Lengthy::update, "computes"};

    void update(hal::Cycle) noexcept {
        for (volatile std::int64_t turn = 0; turn < turns; turn = turn + 1) {
        }
    }
};

}  // namespace

HAL_COMPONENT(Lengthy, "lengthy", "Computes for a while in each cycle")
