// SPDX-License-Identifier: MIT
#include "machine/load/described_modules.hpp"

#include <algorithm>
#include <iterator>

#include "hal/component.hpp"
#include "machine/load/motion_module.hpp"

namespace hal {
namespace {

/// The identity kinematics, which have no pins.
struct TrivialKinematics : Component {
    using Component::Component;
    TextArgument coordinates{*this, "coordinates", "XYZABCUVW", "letters of the joints"};
    TextArgument kinstype{*this, "kinstype", "1", "type of the kinematics"};
};

/// The trajectory planner, which has no pins.
struct TrajectoryPlanner : Component {
    using Component::Component;
    TextArgument parameters{*this, "tp_parms", "", "not used"};
};

/// The homing of joints: `motmod` creates its pins.
struct Homing : Component {
    using Component::Component;
    TextArgument parameters{*this, "home_parms", "", "not used"};
};

/// Returns the description of a module: the names of its pins are complete.
template <class Module>
constexpr hal_component describe(const char* name) {
    hal_component component = detail::component<Module>(name, "a module of LinuxCNC");
    component.flags |= HAL_COMPONENT_SINGLETON | HAL_COMPONENT_WHOLE_NAMES;
    return component;
}

constexpr hal_component modules[] = {
    describe<Homing>("homemod"),
    describe<MotionModule>("motmod"),
    describe<TrajectoryPlanner>("tpmod"),
    describe<TrivialKinematics>("trivkins"),
};

}  // namespace

const hal_component* description_of(std::string_view module) noexcept {
    const auto* const found = std::ranges::find_if(
        modules, [module](const hal_component& one) { return one.name == module; });
    return found == std::end(modules) ? nullptr : found;
}

}  // namespace hal
