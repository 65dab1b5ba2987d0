// SPDX-License-Identifier: MIT
// Every pin that limits something, while it is not a number:
// docs/decisions/0035-a-limit-that-is-not-a-number-keeps-its-last-value.md.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <map>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include "paths.hpp"
#include "unit/components/component_host.hpp"

namespace {

using hal::test::Arguments;
using hal::test::Instance;
constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double period_s = 1e-3;
constexpr double no_limit = std::numeric_limits<double>::infinity();

/// How the limit bounds the output.
enum class Bound { above, below, magnitude, rate, rate_of_rate };

/// What states that the limit is invalid.
enum class Report { fault, own_pin };

struct Setting {
    std::string pin;
    double value;
};

struct Row {
    std::string component;
    std::string limit;            ///< the pin
    double value;            ///< a valid limit that the output exceeds without it
    Bound bound;
    std::string output;
    std::vector<Setting> settings;
    double first = 0.0;      ///< what applies before the first number
    std::vector<std::string> functions = {""};
    Arguments arguments = {};
    std::vector<Setting> later = {};       ///< set after the first cycle
    /// a float pin that alternates between -100 and 100, or an s32 pin that counts
    std::string shaken = {};
    Report report = Report::fault;
};

void PrintTo(const Row& row, std::ostream* to) { *to << row.component << "." << row.limit; }

const std::vector<std::string> pwm{"make-pulses", "update"};

const std::vector<std::string> stepper{"make-pulses", "capture-position", "update-freq"};

std::vector<Setting> enabled(std::vector<Setting> more) {
    more.push_back({"enable", 1});
    return more;
}

const std::vector<Row> rows{
    {"limit1", "max", 2, Bound::above, "out", {{"in", 5}}},
    {"limit1", "min", -2, Bound::below, "out", {{"in", -5}}},
    {"limit2", "max", 2, Bound::above, "out", {{"in", 5}}},
    {"limit2", "min", -2, Bound::below, "out", {{"in", -5}}},
    {"limit2", "maxv", 2, Bound::rate, "out", {{"in", 5}}},
    {"limit3", "max", 2, Bound::above, "out", {{"in", 5}}},
    {"limit3", "min", -2, Bound::below, "out", {{"in", -5}}},
    {"limit3", "maxv", 2, Bound::rate, "out", {{"in", 5}}},
    {"limit3", "maxa", 2, Bound::rate_of_rate, "out", {{"in", 5}}},
    {"integ", "max", 2, Bound::above, "out", {{"in", 1000}}},
    {"integ", "min", -2, Bound::below, "out", {{"in", -1000}}},
    {"quantizer", "max-level", 2, Bound::above, "out", {{"in", 5}}},
    {"quantizer", "min-level", -2, Bound::below, "out", {{"in", -5}}},
    {"knob2float",
     "max-out",
     0.5,
     Bound::above,
     "out",
     {{"scale", 1}, {"enable", 1}},
     1,
     {""},
     {},
     {},
     "counts"},
    {"knob2float",
     "min-out",
     -0.5,
     Bound::below,
     "out",
     {{"scale", -1}, {"enable", 1}},
     0,
     {""},
     {},
     {},
     "counts"},
    {"gearchange", "max1", 100, Bound::above, "speed-out", {{"speed-in", 1e6}}, 1e5},
    {"gearchange", "max2", 100, Bound::above, "speed-out", {{"speed-in", 1e6}, {"sel", 1}}, 1e5},
    {"gearchange", "min1", 100, Bound::below, "speed-out", {{"speed-in", 1}}},
    {"gearchange", "min2", 100, Bound::below, "speed-out", {{"speed-in", 1}, {"sel", 1}}},
    {"pid",
     "maxoutput",
     2,
     Bound::magnitude,
     "output",
     enabled({{"command", 100}}),
     0,
     {"do-pid-calcs"}},
    {"pid",
     "maxerror",
     2,
     Bound::magnitude,
     "output",
     enabled({{"command", 100}}),
     0,
     {"do-pid-calcs"}},
    {"pid",
     "maxerrorI",
     2,
     Bound::magnitude,
     "errorI",
     enabled({{"command", 1e5}, {"Igain", 1}}),
     0,
     {"do-pid-calcs"},
     {{"debug", "1"}}},
    {"pid",
     "maxerrorD",
     2,
     Bound::magnitude,
     "output",
     enabled({{"Pgain", 0}, {"Dgain", 1}}),
     0,
     {"do-pid-calcs"},
     {},
     {},
     "command"},
    {"pid",
     "maxcmdD",
     2,
     Bound::magnitude,
     "output",
     enabled({{"Pgain", 0}, {"FF1", 1}}),
     0,
     {"do-pid-calcs"},
     {},
     {},
     "command"},
    {"pid",
     "maxcmdDD",
     2,
     Bound::magnitude,
     "output",
     enabled({{"Pgain", 0}, {"FF2", 1}}),
     0,
     {"do-pid-calcs"},
     {},
     {},
     "command"},
    {"pid",
     "maxcmdDDD",
     2,
     Bound::magnitude,
     "output",
     enabled({{"Pgain", 0}, {"FF3", 1}}),
     0,
     {"do-pid-calcs"},
     {},
     {},
     "command"},
    {"sampled_pid",
     "max-output",
     2,
     Bound::magnitude,
     "output",
     {{"trigger", 1}, {"command", 100}},
     0,
     {"update"}},
    {"spindle", "max.0", 100, Bound::magnitude, "spindle-rpm",
     enabled(
         {{"simulate-encoder", 1}, {"commanded-speed", 1000}, {"accel.0", 1e6}, {"decel.0", 1e6}})},
    {"spindle", "accel.0", 100, Bound::rate, "spindle-rpm",
     enabled(
         {{"simulate-encoder", 1}, {"commanded-speed", 1000}, {"max.0", 1000}, {"decel.0", 1e6}})},
    {"spindle", "min.0", 100, Bound::below, "spindle-rpm",
     enabled({{"simulate-encoder", 1},
              {"commanded-speed", 1},
              {"max.0", 1000},
              {"accel.0", 1e7},
              {"decel.0", 1e7}})},
    {"noise", "limit", 2, Bound::magnitude, "noise", enabled({{"amplitude", 100}, {"type", 1}})},
    {"dc_motor",
     "current-limit",
     0.5,
     Bound::magnitude,
     "current",
     enabled({{"voltage", 24}}),
     4,
     {"update"}},
    {"furuta",
     "current-limit",
     0.5,
     Bound::magnitude,
     "motor-current",
     {{"voltage", 24}},
     4,
     {"update"}},
    {"simple_tp",
     "maxvel",
     2,
     Bound::magnitude,
     "current-vel",
     enabled({{"target-pos", 1e6}, {"maxaccel", 1e6}}),
     0,
     {"update"}},
    {"simple_tp",
     "maxaccel",
     2,
     Bound::rate,
     "current-vel",
     enabled({{"target-pos", 1e6}, {"maxvel", 1e6}}),
     0,
     {"update"}},
    {"anglejog",
     "max-vel",
     2,
     Bound::magnitude,
     "current-vel",
     {{"scale-in", 1}, {"max-accel", 1e6}},
     0,
     {""},
     {},
     {{"enable-in", 1}, {"counts-in", 100000}}},
    {"anglejog",
     "max-accel",
     2,
     Bound::rate,
     "current-vel",
     {{"scale-in", 1}, {"max-vel", 1e6}},
     0,
     {""},
     {},
     {{"enable-in", 1}, {"counts-in", 100000}}},
    {"moveoff",
     "offset-max-0",
     0.05,
     Bound::above,
     "offset-current-0",
     {{"power-on", 1}, {"move-enable", 1}, {"apply-offsets", 1}, {"offset-in-0", 1000}},
     0,
     {"read-inputs", "write-outputs"}},
    {"moveoff",
     "offset-min-0",
     -0.05,
     Bound::below,
     "offset-current-0",
     {{"power-on", 1}, {"move-enable", 1}, {"apply-offsets", 1}, {"offset-in-0", -1000}},
     0,
     {"read-inputs", "write-outputs"}},
    {"moveoff",
     "offset-vel-0",
     2,
     Bound::rate,
     "offset-current-0",
     {{"power-on", 1}, {"move-enable", 1}, {"apply-offsets", 1}, {"offset-in-0", 1000}},
     10,
     {"read-inputs", "write-outputs"}},
    {"moveoff",
     "offset-accel-0",
     2,
     Bound::rate_of_rate,
     "offset-current-0",
     {{"power-on", 1}, {"move-enable", 1}, {"apply-offsets", 1}, {"offset-in-0", 1000}},
     100,
     {"read-inputs", "write-outputs"}},
    {"pwmgen", "max-dc", 0.3, Bound::magnitude, "curr-dc", enabled({{"value", 1}}), 1, pwm},
    {"pwmgen",
     "min-dc",
     0.3,
     Bound::below,
     "curr-dc",
     enabled({{"value", 0}}),
     0,
     pwm,
     {},
     {{"enable", 1}}},
    {"stepgen",
     "maxvel",
     50,
     Bound::magnitude,
     "frequency",
     enabled({{"velocity-cmd", 400}}),
     0,
     stepper,
     {{"ctrl_type", "v"}}},
    {"stepgen",
     "maxaccel",
     50,
     Bound::rate,
     "frequency",
     enabled({{"velocity-cmd", 400}}),
     0,
     stepper,
     {{"ctrl_type", "v"}}},
    {"arm_kinematics",
     "max-speed",
     2,
     Bound::rate,
     "command-0",
     {{"position-only", 1}, {"target-0", 0.2}},
     10,
     {"update"},
     {},
     {},
     "target-1"},
    {"mill_kinematics",
     "max-speed",
     2,
     Bound::rate,
     "command-3",
     {{"target-5", 1}},
     10,
     {"update"},
     {},
     {},
     "target-3"},
    {"diff_drive",
     "max-wheel-speed",
     0.5,
     Bound::magnitude,
     "left-speed",
     {{"linear", 100}, {"left-radius", 1}},
     0,
     {"command"}},
    {"diff_drive",
     "max-linear",
     0.5,
     Bound::magnitude,
     "left-speed",
     {{"linear", 100}, {"left-radius", 1}},
     0,
     {"command"}},
    {"diff_drive",
     "max-angular",
     0.5,
     Bound::magnitude,
     "left-speed",
     {{"angular", 100}, {"left-radius", 1}, {"track", 2}},
     0,
     {"command"}},
    {"diff_drive",
     "max-linear-acceleration",
     0.5,
     Bound::rate,
     "left-speed",
     {{"linear", 100}, {"left-radius", 1}},
     0,
     {"command"}},
    {"diff_drive",
     "max-angular-acceleration",
     0.5,
     Bound::rate,
     "left-speed",
     {{"angular", 100}, {"left-radius", 1}, {"track", 2}},
     0,
     {"command"}},
    {"pxmc_axis",
     "max-output",
     2,
     Bound::magnitude,
     "output",
     enabled({{"P", 1e6}, {"requested-position", 100}}),
     0,
     {"do-control"},
     {},
     {{"go", 1}}},
    {"pxmc_axis",
     "max-speed",
     0.5,
     Bound::magnitude,
     "commanded-speed",
     enabled({{"requested-position", 100}, {"max-acceleration", 1e3}}),
     1,
     {"do-control"},
     {},
     {{"go", 1}},
     {},
     Report::own_pin},
    {"motion_profile",
     "max-velocity",
     0.5,
     Bound::magnitude,
     "velocity",
     {{"target", 100}, {"max-acceleration", 1e3}},
     1,
     {""},
     {},
     {},
     {},
     Report::own_pin},
    {"motion_profile",
     "max-acceleration",
     0.5,
     Bound::magnitude,
     "acceleration",
     {{"target", 100}},
     1,
     {""},
     {},
     {},
     {},
     Report::own_pin},
    {"motion_profile",
     "max-jerk",
     0.5,
     Bound::magnitude,
     "jerk",
     {{"target", 100}},
     no_limit,
     {""},
     {},
     {},
     {},
     Report::own_pin},
    {"force_control",
     "max-effort",
     2,
     Bound::magnitude,
     "effort",
     enabled({{"force-command", 1000}}),
     0,
     {"update"}},
    {"force_control",
     "max-offset",
     0.001,
     Bound::magnitude,
     "position-out",
     enabled({{"force-command", 1000}, {"mode", 1}}),
     0,
     {"update"}},
    {"lqr",
     "max-output",
     2,
     Bound::magnitude,
     "u-0",
     {{"x-0", 100}},
     0,
     {"update"},
     {{"plant", "sampled"}, {"a", "0,1;0,0"}, {"b", "0;0.5"}, {"q", "100,0;0,1"}, {"r", "0.01"}}},
    {"furuta_control",
     "max-torque",
     0.01,
     Bound::magnitude,
     "torque",
     enabled({{"pendulum-angle", 0.5}, {"pendulum-velocity", 3}}),
     0.2708,
     {"update"}},
    {"drive_to", "max-speed", 0.1, Bound::magnitude, "linear", enabled({{"target-x", 100}}), 0.5},
    {"drive_around",
     "max-speed",
     0.1,
     Bound::magnitude,
     "linear",
     enabled({{"target-x", 100}}),
     0.5,
     {"update"}},
    {"drive_around",
     "max-turn",
     0.1,
     Bound::magnitude,
     "angular",
     enabled({{"target-y", 100}}),
     1.5,
     {"update"}},
};

/// Float inputs and parameters that are named like a limit and have no row; a final * stands for
/// all that begin so.
const std::map<std::string, std::string> others{
    {"axistest.maxvel", "the distance of a jog"},
    {"beacon_position.*", "bounds of the field; with NaN no position is valid"},
    {"cia402.homing-timeout", "a time; NaN is none"},
    {"cia402.max-*",
     "set-points of the drive, in its integers, and monitors; LimitPin in the component"},
    {"dc_motor.max-position", "position of a simulated switch"},
    {"dc_motor.min-position", "position of a simulated switch"},
    {"encoder.min-speed-estimate", "a threshold: below it the speed is 0"},
    {"finger.max-effort", "a simulated actuator; LimitPin in the component"},
    {"furuta_control.max-acceleration", "within the swing-up, whose torque has a row"},
    {"furuta_control.max-arm-velocity", "within the swing-up, whose torque has a row"},
    {"heartbeat_monitor.min-time", "an invalid parameter stops: supervision_test.cpp"},
    {"histobins.minvalue", "edge of a histogram"},
    {"hm2_eth.*", "another name of mesa"},
    {"kinematics.*", "the deprecated name of arm_kinematics"},
    {"limit_axis.*", "the limits that it gives are held: catalogue_test.cpp"},
    {"mesa.*", "step generators of a card; LimitPin in the component"},
    {"motion_profile.max-deceleration", "rejected with the others of its set"},
    {"ohmic.thcad-max-volt-freq", "a scale"},
    {"pxmc_axis.max-acceleration", "rejected with the others of its set"},
    {"pxmc_axis.max-following-error", "a monitor; LimitPin in the component"},
    {"pxmc_axis.max-jerk", "rejected with the others of its set"},
    {"pxmc_axis.max-position", "rejected with the others of its set"},
    {"pxmc_axis.min-position", "rejected with the others of its set"},
    {"safe_limit.*", "an invalid parameter is a stop 0: safety_test.cpp"},
    {"safety_switch.*", "an invalid parameter is a fault: safety_switch_test.cpp"},
    {"sim_axis_hardware.*", "positions of simulated switches"},
    {"steptest.*", "the distance of a jog; the follower has the limits"},
    {"vision_*", "thresholds of an image, nothing is within NaN"},
    {"wcomp.*", "a comparator: nothing is within a window with NaN"},
};

bool is_stated(const std::string& pin) {
    return std::any_of(others.begin(), others.end(), [&](const auto& other) {
        const std::string& name = other.first;
        return name == pin ||
               (name.ends_with('*') && pin.starts_with(name.substr(0, name.size() - 1)));
    });
}

struct Faults {
    hal_faults record{};
    int raised = 0;
    std::string text = {};  ///< the newest
    Faults() {
        record.size = sizeof record;
        record.raise = [](const hal_faults* of, const void*, const char* reason, double) {
            if (std::string_view(reason).starts_with("a limit is not a number")) {
                Faults& faults = *reinterpret_cast<Faults*>(const_cast<hal_faults*>(of));
                ++faults.raised;
                faults.text = reason;
            }
        };
    }
};
static_assert(offsetof(Faults, record) == 0);

void set(Instance& instance, const std::string& pin, double value) {
    switch (instance.pin(pin).type) {
    case HAL_TYPE_BIT: return instance.set(pin, value != 0.0);
    case HAL_TYPE_FLOAT: return instance.set(pin, value);
    default: return instance.set(pin, static_cast<int>(value));
    }
}

/// Runs a row's machine and checks its output after each cycle.
class Machine {
public:
    explicit Machine(const Row& row)
        : row_(row), instance_(row.component, row.arguments, {{"hal.faults/1", &faults_.record}}) {
        for (const Setting& s : row.settings) {
            set(instance_, s.pin, s.value);
        }
    }
    void limit(double value) { instance_.set(row_.limit, value); }
    /// Expects the output within `bound` in each of the cycles.
    void run(int cycles, double bound) {
        for (int i = 0; i < cycles; ++i) {
            drive();
            for (const std::string& function : row_.functions) {
                instance_.run(function);
            }
            if (number_++ == 0) {
                for (const Setting& s : row_.later) {
                    set(instance_, s.pin, s.value);
                }
            }
            const double out = instance_.get<double>(row_.output);
            check(out, bound);
            rate_before_ = (out - before_) / period_s;
            before_ = out;
        }
    }
    int faults() const { return faults_.raised; }
    const std::string& fault_text() const { return faults_.text; }

private:
    void drive() {
        if (row_.shaken.empty()) return;
        if (instance_.pin(row_.shaken).type == HAL_TYPE_S32) {
            instance_.set(row_.shaken, number_ + 1);
        } else {
            instance_.set(row_.shaken, number_ % 2 == 0 ? 100.0 : -100.0);
        }
    }
    void check(double out, double bound) const {
        const double slack = 1e-9 * (1.0 + std::fabs(bound));
        const double rate = (out - before_) / period_s;
        ASSERT_FALSE(std::isnan(out));
        switch (row_.bound) {
        case Bound::above: ASSERT_LE(out, bound + slack); break;
        case Bound::below: ASSERT_GE(out, bound - slack); break;
        case Bound::magnitude: ASSERT_LE(std::fabs(out), bound + slack); break;
        case Bound::rate: ASSERT_LE(std::fabs(rate), bound + 1e6 * slack * period_s); break;
        case Bound::rate_of_rate:
            ASSERT_LE(std::fabs(rate - rate_before_) / period_s, bound + 1e6 * slack);
            break;
        }
    }

    const Row& row_;
    Faults faults_;
    Instance instance_;
    int number_ = 0;
    double before_ = 0.0;
    double rate_before_ = 0.0;
};

bool is_built(const std::string& component) {
    return std::filesystem::exists(std::string(hal::paths::build_components) + "/" + component +
                                   ".so");
}

struct LimitPin : testing::TestWithParam<Row> {
    void SetUp() override {
        if (!is_built(GetParam().component)) {
            GTEST_SKIP() << "not built";
        }
    }
};

TEST_P(LimitPin, Applies_with_its_last_value_while_it_is_not_a_number) {
    const Row& row = GetParam();
    Machine machine(row);
    machine.limit(row.value);
    machine.run(50, row.value);
    EXPECT_EQ(machine.faults(), 0);
    machine.limit(nan);
    machine.run(50, row.value);
    EXPECT_EQ(machine.faults(), row.report == Report::fault ? 1 : 0);
    machine.limit(row.value);
    machine.run(5, row.value);
    machine.limit(nan);
    machine.run(50, row.value);
    EXPECT_EQ(machine.faults(), row.report == Report::fault ? 2 : 0);
    if (row.report == Report::fault) {
        EXPECT_EQ(machine.fault_text(), "a limit is not a number; its last valid value applies");
    }
}

TEST_P(LimitPin, Lets_nothing_beyond_its_default_pass_before_it_was_a_number) {
    const Row& row = GetParam();
    Machine machine(row);
    machine.limit(nan);
    machine.run(50, row.first);
    EXPECT_EQ(machine.faults(), row.report == Report::fault ? 1 : 0);
    if (row.report == Report::fault) {
        const std::string begin = "a limit is not a number and never was one; ";
        const std::string& text = machine.fault_text();
        if (std::string_view(row.component) == "furuta") {  // reads its default when it is made
            EXPECT_EQ(text, "a limit is not a number; its last valid value applies");
        } else if (row.first != 0.0) {
            EXPECT_EQ(text, begin + "its default applies");
        } else {
            const std::vector<std::string> ends{"its default applies", "0 applies",
                                                "nothing passes"};
            EXPECT_TRUE(std::ranges::any_of(ends, [&](const std::string& end) {
                return text == begin + end;
            })) << text;
        }
    }
}

TEST(LimitText, States_that_0_applies_when_the_default_is_not_a_limit) {
    Faults faults;
    Instance limit("limit1", {}, {{"hal.faults/1", &faults.record}});
    limit.set("max", nan);
    limit.run("");
    EXPECT_EQ(faults.text, "a limit is not a number and never was one; 0 applies");
}

TEST(LimitText, States_that_nothing_passes_where_0_means_that_there_is_no_limit) {
    Faults faults;
    Instance spindle("spindle", {}, {{"hal.faults/1", &faults.record}});
    spindle.set("max.0", nan);
    spindle.run("");
    EXPECT_EQ(faults.text, "a limit is not a number and never was one; nothing passes");
}

TEST(LimitText, Of_a_bypass_knows_the_time_that_was_valid_before_the_bypass) {
    Faults faults;
    Instance lock("interlock", {{"inputs", "1"}}, {{"hal.faults/1", &faults.record}});
    lock.set("start-needs-reset", false);
    lock.set("in-00", true);
    lock.set("bypass-mask", std::uint64_t{1});
    lock.set("bypass-time", 0.1);
    lock.run("");
    lock.set("bypass-time", nan);
    lock.run("");
    EXPECT_EQ(faults.text, "a limit is not a number; its last valid value applies");
    lock.set("bypass-enable", true);
    lock.set("in-00", false);
    for (int cycle = 0; cycle < 50; ++cycle) {
        lock.run("");
        ASSERT_TRUE(lock.get<bool>("ok")) << cycle;
    }
    for (int cycle = 0; cycle < 60; ++cycle) {
        lock.run("");
    }
    EXPECT_FALSE(lock.get<bool>("ok"));
    EXPECT_EQ(faults.raised, 1);
}

INSTANTIATE_TEST_SUITE_P(Every_limit, LimitPin, testing::ValuesIn(rows), [](const auto& row) {
    return std::regex_replace(row.param.component + "_" + row.param.limit,
                              std::regex("[^A-Za-z0-9]"), "_");
});

TEST(LimitPins, Are_all_in_the_table) {
    const std::regex name("(max|min|limit)");
    std::set<std::string> known, missing;
    for (const Row& row : rows) {
        known.insert(row.component + "." +
                     std::regex_replace(row.limit, std::regex("[0-9]+"), "#"));
    }
    for (const auto& file : std::filesystem::directory_iterator(hal::paths::build_components)) {
        if (file.path().extension() != ".so") continue;
        const std::string component = file.path().stem();
        const Instance instance(component, {}, {}, Instance::Life::created);
        for (const auto& pin : instance.pins()) {
            if (pin.type != HAL_TYPE_FLOAT || pin.dir == HAL_DIR_OUT ||
                (pin.flags & HAL_PIN_READ_ONLY) != 0) {
                continue;
            }
            const std::string general =
                component + "." + std::regex_replace(pin.name, std::regex("[0-9]+"), "#");
            if (std::regex_search(pin.name, name) && !known.contains(general) &&
                !is_stated(general)) {
                missing.insert(general);
            }
        }
    }
    for (const std::string& pin : missing) {
        ADD_FAILURE() << pin << ": add a row, or state in `others` why it limits no output";
    }
}

}  // namespace
