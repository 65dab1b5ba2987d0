// SPDX-License-Identifier: MIT
#include "model/namesakes.hpp"

#include <algorithm>
#include <span>

#include "model/model.hpp"
#include "text/quoting.hpp"

namespace hal {

namespace {

/// A component of LinuxCNC's users that has the name of one of Halcyon's.
struct Namesake {
    const char* component;
    const char* other;  ///< what the other component is
    std::span<const char* const> other_pins;  ///< those that ours does not have
};

constexpr const char* community_cia402[] = {"opmode",
                                            "opmode-display",
                                            "drv-actual-position",
                                            "drv-actual-velocity",
                                            "drv-target-position",
                                            "drv-target-velocity",
                                            "drv-fault",
                                            "pos-cmd",
                                            "pos-fb",
                                            "pos-scale",
                                            "velo-scale",
                                            "csp-mode",
                                            "fault-reset",
                                            "auto-fault-reset",
                                            "stat-homed",
                                            "stat-homing",
                                            "stat-fault",
                                            "stat-op-enabled",
                                            "stat-target-reached",
                                            "opmode-no-mode",
                                            "opmode-homing",
                                            "opmode-cyclic-position",
                                            "opmode-cyclic-velocity"};
constexpr Namesake namesakes[] = {
    {"cia402", "the community's cia402.comp for LinuxCNC", community_cia402}};

}  // namespace

std::string namesake_help(const Model& model, std::string_view pin) {
    const std::size_t dot = pin.rfind('.');
    if (dot == std::string_view::npos) return {};
    const Instance* const instance = model.find_instance(pin.substr(0, dot));
    if (instance == nullptr) return {};
    const std::string& component = instance->component->name;
    const auto found = std::ranges::find(namesakes, component, &Namesake::component);
    if (found == std::end(namesakes)) return {};
    const bool is_linuxcncs = instance->component->shares_pins;
    if (is_linuxcncs) {
        return "this is " + std::string(found->other) + "; for Halcyon's " + component +
               ", type: loadrt --native " + component;
    }
    const std::string_view name = pin.substr(dot + 1);
    if (std::ranges::find(found->other_pins, name) == found->other_pins.end()) return {};
    return hal::quoted(name) + " is a pin of " + found->other + "; this is Halcyon's " + component +
           ". Type: loadrt --linuxcnc " + component + ", where that one is installed";
}

}  // namespace hal
