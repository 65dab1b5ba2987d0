// SPDX-License-Identifier: MIT
// Outputs that command motion have a safe value, which they take when their thread stops.
#include <regex>

#include "rt/any_component.hpp"
#include "unit/machine.hpp"

namespace hal::test {
namespace {

// Names of commands to a motor, a drive or an axis; # is any number.
const std::regex command(
    "output|command|command-#|linear|angular|drive|pwm|up|down|step|forward|"
    "reverse|motor-(vel|fwd|rev)|velocity|velocity-(out|cmd)|speed-out|"
    "(left|right)-speed|target-(velocity|torque)|controlword|torque-out|"
    "effort|[ABC]-value|power|enabled?");

// Outputs of such a name that may keep their value, with the reason.
const std::map<std::string, const char*> others{
    {"arm_kinematics.command-#", "a position, which is held"},
    {"canopen_axis_io.enabled", "the state of a simulated device"},
    {"canopen_axis_io.pwm", "the state of a simulated device"},
    {"counter.velocity", "measured"},
    {"dc_motor.velocity", "the state of a simulated motor"},
    {"encoder.velocity", "measured"},
    {"finger.velocity", "the state of a simulated finger"},
    {"kinematics.command-#", "a position, which is held"},
    {"mill_kinematics.command-#", "a position, which is held"},
    {"orient.command", "a position, which is held"},
    {"sim_hctl1100.drive", "the state of a simulated motor"},
    {"sim_ultrasound.step", "a number of a direction"},
    {"spring_damper.velocity", "the state of a simulated mass"},
    {"step_program.step", "a number of a step"},
    {"step_series.command", "a set-point, which is held"},
};

std::string general(const Pin& pin) {
    const std::string below = pin.name.substr(pin.instance->name.size() + 1);
    return std::regex_replace(below, std::regex("[0-9]+"), "#");
}

struct SafeOutputs : testing::TestWithParam<std::string> {};

TEST_P(SafeOutputs, include_all_commands_of_motion) {
    Machine machine;
    const auto lock = machine.session.lock();
    machine.must(load(GetParam()));
    for (const Pin* const pin : machine.session.model().sorted_pins()) {
        if (!pin->instance || pin->dir != HAL_DIR_OUT || pin->safe_output()) continue;
        const std::string name = general(*pin);
        if (!std::regex_match(name, command)) continue;
        const std::string known = GetParam() + "." + name;
        EXPECT_TRUE(others.contains(known))
            << known << " has no safe value; add one, or a reason why it is not a command";
    }
}

INSTANTIATE_TEST_SUITE_P(Of, SafeOutputs, testing::ValuesIn(all_components()),
                         [](const auto& component) { return component.param; });

}  // namespace
}  // namespace hal::test
