// SPDX-License-Identifier: MIT
#include "model/namesakes.hpp"

#include <algorithm>
#include <span>

#include "model/model.hpp"
#include "text/quoting.hpp"

namespace hal {

namespace {

/// A name that two components have. Each is recognised by pins that the other does not have.
struct Namesake {
    const char* component;
    const char* other;  ///< where the other component comes from
    std::span<const char* const> own_pins;
    std::span<const char* const> other_pins;
};

constexpr const char* own_cia402[] = {"modes-of-operation",
                                      "modes-of-operation-display",
                                      "position-actual-value",
                                      "velocity-actual-value",
                                      "torque-actual-value",
                                      "target-position",
                                      "target-velocity",
                                      "target-torque",
                                      "position-cmd",
                                      "position-fb",
                                      "position-scale",
                                      "velocity-scale",
                                      "fault",
                                      "reset",
                                      "mode",
                                      "mode-fb",
                                      "enabled",
                                      "active",
                                      "operational"};
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
    {"cia402", "the community's cia402.comp for LinuxCNC", own_cia402, community_cia402}};

bool contains(std::span<const char* const> names, std::string_view name) {
    return std::find(names.begin(), names.end(), name) != names.end();
}

}  // namespace

std::string namesake_help(const Model& model, std::string_view pin) {
    const std::size_t dot = pin.rfind('.');
    if (dot == std::string_view::npos) return {};
    const Instance* const instance = model.find_instance(pin.substr(0, dot));
    if (instance == nullptr) return {};
    const std::string& component = instance->component->name;
    const auto found =
        std::find_if(std::begin(namesakes), std::end(namesakes),
                     [&](const Namesake& one) { return component == one.component; });
    if (found == std::end(namesakes)) return {};
    const std::string_view name = pin.substr(dot + 1);
    const std::string begin = hal::quoted(std::string(name)) + " is a pin of ";
    if (contains(found->other_pins, name)) {
        return begin + found->other + "; this is Halcyon's " + component +
               ". Type: loadrt --linuxcnc " + component + ", where that one is installed";
    }
    if (contains(found->own_pins, name)) {
        return begin + "Halcyon's " + component + "; this is " + found->other +
               ". Type: loadrt --native " + component;
    }
    return {};
}

}  // namespace hal
