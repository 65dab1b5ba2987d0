// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

namespace {

/// In LinuxCNC the part of the driver that knows the firmware is a module of its own.
struct HostMot2 : hal::Component {
    using Component::Component;
    hal::Argument idrom{*this, "debug_idrom", 0, "not used"};
    hal::Argument module_descriptors{*this, "debug_module_descriptors", 0, "not used"};
    hal::Argument pin_descriptors{*this, "debug_pin_descriptors", 0, "not used"};
    hal::Argument modules{*this, "debug_modules", 0, "not used"};
    hal::Argument serial_numbers{*this, "use_serial_numbers", 0, "not used"};
};

}  // namespace

HAL_COMPONENT(HostMot2, "hostmot2", "Does nothing: for netlists that load LinuxCNC's hostmot2", R"(
Netlists of LinuxCNC load `hostmot2` before `hm2_eth`. Here `hm2_eth` is complete, and this component has neither pins nor functions.

    loadrt --native hostmot2
)")
