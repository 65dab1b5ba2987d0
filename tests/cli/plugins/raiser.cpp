// SPDX-License-Identifier: MIT
// Raises a fault in each cycle.
#include "hal/component.hpp"

namespace {

struct Raiser : hal::Component {
    using Component::Component;
    hal::Function run{*this, "", &Raiser::update, "raises a fault"};

    void start() { faults_ = hal::extension<hal_faults>("hal.faults/1"); }
    void update(hal::Cycle) noexcept { faults_->raise(faults_, this, "on purpose", 0.0); }

private:
    const hal_faults* faults_ = nullptr;
};

}  // namespace

HAL_COMPONENT(Raiser, "raiser", "Raises a fault in each cycle")
