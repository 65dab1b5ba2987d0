// SPDX-License-Identifier: MIT
#include "machine/load/motion_module.hpp"

#include <algorithm>
#include <new>
#include <span>
#include <string>
#include <vector>

#include "hal/modules.h"

namespace hal {
namespace {

struct Row {
    const char* name;
    hal_type type;
    hal_dir dir;
};

constexpr hal_type bit = HAL_TYPE_BIT;
constexpr hal_type s32 = HAL_TYPE_S32;
constexpr hal_type u32 = HAL_TYPE_U32;
constexpr hal_type real = HAL_TYPE_FLOAT;
constexpr hal_dir in = HAL_DIR_IN;
constexpr hal_dir out = HAL_DIR_OUT;
constexpr hal_dir io = HAL_DIR_IO;
constexpr hal_dir parameter = HAL_DIR_PARAM;

constexpr Row machine_rows[] = {
    {"motion.adaptive-feed", real, in},
    {"motion.coord-error", bit, out},
    {"motion.coord-mode", bit, out},
    {"motion.current-vel", real, out},
    {"motion.debug-bit-0", bit, parameter},
    {"motion.debug-bit-1", bit, parameter},
    {"motion.debug-float-0", real, parameter},
    {"motion.debug-float-1", real, parameter},
    {"motion.debug-float-2", real, parameter},
    {"motion.debug-float-3", real, parameter},
    {"motion.debug-s32-0", s32, parameter},
    {"motion.debug-s32-1", s32, parameter},
    {"motion.distance-to-go", real, out},
    {"motion.enable", bit, in},
    {"motion.eoffset-active", bit, out},
    {"motion.eoffset-limited", bit, out},
    {"motion.feed-hold", bit, in},
    {"motion.feed-inches-per-minute", real, out},
    {"motion.feed-inches-per-second", real, out},
    {"motion.feed-inhibit", bit, in},
    {"motion.feed-mm-per-minute", real, out},
    {"motion.feed-mm-per-second", real, out},
    {"motion.feed-upm", real, out},
    {"motion.homing-inhibit", bit, in},
    {"motion.in-position", bit, out},
    {"motion.interp.arc-center-x", real, out},
    {"motion.interp.arc-center-y", real, out},
    {"motion.interp.arc-center-z", real, out},
    {"motion.interp.arc-radius", real, out},
    {"motion.interp.feedrate", real, out},
    {"motion.interp.heading", real, out},
    {"motion.interp.iscircle", bit, out},
    {"motion.interp.line-number", s32, out},
    {"motion.interp.motion-type", s32, out},
    {"motion.interp.normal-heading", real, out},
    {"motion.is-all-homed", bit, out},
    {"motion.jog-inhibit", bit, in},
    {"motion.jog-is-active", bit, out},
    {"motion.jog-stop", bit, in},
    {"motion.jog-stop-immediate", bit, in},
    {"motion.motion-enabled", bit, out},
    {"motion.motion-type", s32, out},
    {"motion.on-soft-limit", bit, out},
    {"motion.probe-input", bit, in},
    {"motion.program-line", s32, out},
    {"motion.requested-vel", real, out},
    {"motion.servo.last-period", u32, out},
    {"motion.servo.last-period-ns", real, out},
    {"motion.switchkins-type", real, in},
    {"motion.teleop-mode", bit, out},
    {"motion.tooloffset.a", real, out},
    {"motion.tooloffset.b", real, out},
    {"motion.tooloffset.c", real, out},
    {"motion.tooloffset.u", real, out},
    {"motion.tooloffset.v", real, out},
    {"motion.tooloffset.w", real, out},
    {"motion.tooloffset.x", real, out},
    {"motion.tooloffset.y", real, out},
    {"motion.tooloffset.z", real, out},
    {"motion.tp-reverse", bit, out},
    {"traj.active_tc", u32, parameter},
    {"traj.pos_out", real, parameter},
    {"traj.vel_out", real, parameter},
};

/// Of the trajectory planner's segments tc.0 to tc.3.
constexpr Row segment_rows[] = {
    {"acc", real, parameter},
    {"pos", real, parameter},
    {"vel", real, parameter},
};

/// Of joint.N, with what homemod adds.
constexpr Row joint_rows[] = {
    {"acc-cmd", real, out},       {"active", bit, out},
    {"amp-enable-out", bit, out}, {"amp-fault-in", bit, in},
    {"backlash-corr", real, out}, {"backlash-filt", real, out},
    {"backlash-vel", real, out},  {"coarse-pos-cmd", real, out},
    {"error", bit, out},          {"f-error", real, out},
    {"f-error-lim", real, out},   {"f-errored", bit, out},
    {"faulted", bit, out},        {"free-pos-cmd", real, out},
    {"free-tp-enable", bit, out}, {"free-vel-lim", real, out},
    {"home-state", s32, out},     {"home-sw-in", bit, in},
    {"homed", bit, out},          {"homing", bit, out},
    {"in-position", bit, out},    {"index-enable", bit, io},
    {"jerk-cmd", real, out},      {"jog-accel-fraction", real, in},
    {"jog-counts", s32, in},      {"jog-enable", bit, in},
    {"jog-scale", real, in},      {"jog-vel-mode", bit, in},
    {"kb-jog-active", bit, out},  {"motor-offset", real, out},
    {"motor-pos-cmd", real, out}, {"motor-pos-fb", real, in},
    {"neg-hard-limit", bit, out}, {"neg-lim-sw-in", bit, in},
    {"pos-cmd", real, out},       {"pos-fb", real, out},
    {"pos-hard-limit", bit, out}, {"pos-lim-sw-in", bit, in},
    {"vel-cmd", real, out},       {"wheel-jog-active", bit, out},
};

/// Of the joints in unlock_joints_mask.
constexpr Row unlock_rows[] = {
    {"is-unlocked", bit, in},
    {"unlock", bit, out},
};

/// Of spindle.N.
constexpr Row spindle_rows[] = {
    {"amp-fault-in", bit, in},    {"at-speed", bit, in},        {"brake", bit, out},
    {"forward", bit, out},        {"index-enable", bit, io},    {"inhibit", bit, in},
    {"is-oriented", bit, in},     {"locked", bit, out},         {"on", bit, out},
    {"orient", bit, out},         {"orient-angle", real, out},  {"orient-fault", s32, in},
    {"orient-mode", s32, out},    {"reverse", bit, out},        {"revs", real, in},
    {"speed-cmd-rps", real, out}, {"speed-in", real, in},       {"speed-out", real, out},
    {"speed-out-abs", real, out}, {"speed-out-rps", real, out}, {"speed-out-rps-abs", real, out},
};

/// Of axis.L for each letter.
constexpr Row axis_rows[] = {
    {"eoffset", real, out},           {"eoffset-clear", bit, in},
    {"eoffset-counts", s32, in},      {"eoffset-enable", bit, in},
    {"eoffset-request", real, out},   {"eoffset-scale", real, in},
    {"jog-accel-fraction", real, in}, {"jog-counts", s32, in},
    {"jog-enable", bit, in},          {"jog-scale", real, in},
    {"jog-vel-mode", bit, in},        {"kb-jog-active", bit, out},
    {"pos-cmd", real, out},           {"teleop-pos-cmd", real, out},
    {"teleop-tp-enable", bit, out},   {"teleop-vel-cmd", real, out},
    {"teleop-vel-lim", real, out},    {"wheel-jog-active", bit, out},
};

constexpr std::int64_t max_joints = 16;
constexpr std::int64_t max_spindles = 8;
constexpr std::int64_t max_pins = 64;  // of a kind: digital, analog, errors
constexpr std::int64_t usual_pins = 4;  // digital and analog, where the line gives no number

void declare(const std::string& name, const Row& row) {
    const hal_host* const host = detail::creating;
    auto* const pin =
        static_cast<hal_pin*>(host->allocate(host, sizeof(hal_pin), alignof(hal_pin)));
    if (pin == nullptr) throw std::bad_alloc();
    hal_pin_decl decl{};
    decl.size = sizeof decl;
    decl.name = name.c_str();
    decl.doc = "";
    decl.unit = "";
    decl.type = row.type;
    decl.dir = row.dir;
    if (!host->pin(host, &decl, pin)) {
        detail::rejected();
    }
}

void declare_all(const std::string& prefix, std::span<const Row> rows) {
    for (const Row& row : rows) {
        declare(prefix + row.name, row);
    }
}

/// Returns the names of a list such as names_din=door,air.
std::vector<std::string> names_in(const std::string& list) {
    std::vector<std::string> names;
    std::size_t begin = 0;
    while (begin < list.size()) {
        const std::size_t end = std::min(list.find(',', begin), list.size());
        names.push_back(list.substr(begin, end - begin));
        begin = end + 1;
    }
    return names;
}

/// Declares `count` pins: NAMED-name for each name of the list, and NUMBERED-00, -01 ... for the
/// others.
void declare_list(const std::string& named, const std::string& numbered, const std::string& list,
                  std::int64_t count, const Row& row) {
    const std::vector<std::string> names = names_in(list);
    for (const std::string& name : names) {
        declare(named + name, row);
    }
    const std::int64_t others = count - static_cast<std::int64_t>(names.size());
    for (std::int64_t i = 0; i < others; ++i) {
        declare((i < 10 ? numbered + "0" : numbered) + std::to_string(i), row);
    }
}

/// Returns how many pins of a kind there are: as many as the line states, or as it names.
std::int64_t count_of(std::int64_t stated, const std::string& inputs, const std::string& outputs) {
    if (stated > 0) return stated;
    const std::size_t named = std::max(names_in(inputs).size(), names_in(outputs).size());
    return named > 0 ? static_cast<std::int64_t>(named) : usual_pins;
}

}  // namespace

MotionModule::MotionModule(const hal_host* host)
    : Component(host),
      joints_(*this, "num_joints", max_joints, "number of joints", {.min = 1, .max = max_joints}),
      extra_joints_(*this, "num_extrajoints", 0, "joints without kinematics",
                    {.min = 0, .max = max_joints}),
      spindles_(*this, "num_spindles", 1, "number of spindles", {.min = 0, .max = max_spindles}),
      unlock_mask_(*this, "unlock_joints_mask", 0, "joints with pins to unlock them"),
      base_period_ns_(*this, "base_period_nsec", 0, "period of the thread base-thread; 0: none"),
      servo_period_ns_(*this, "servo_period_nsec", 1'000'000, "period of the thread servo-thread"),
      command_handler_(*this, "motion-command-handler", &MotionModule::handle_commands,
                       "reads the commands of the task program"),
      controller_(*this, "motion-controller", &MotionModule::control, "moves the joints") {
    for (const char* const ignored : {"key", "base_thread_fp", "traj_period_nsec"}) {
        const Argument asked(*this, ignored, 0, "not used");
    }
    declare_all("", machine_rows);
    for (int i = 0; i < 4; ++i) {
        declare_all("tc." + std::to_string(i) + ".", segment_rows);
    }
    for (std::int64_t i = 0; i < spindles_; ++i) {
        declare_all("spindle." + std::to_string(i) + ".", spindle_rows);
    }
    for (const char letter : std::string("xyzabcuvw")) {
        declare_all(std::string("axis.") + letter + ".", axis_rows);
    }
    declare_joints();
    declare_digital_pins();
    declare_analog_pins();
    declare_errors();
    add_threads();
}

void MotionModule::declare_joints() {
    constexpr Row position_after_homing{"posthome-cmd", real, in};
    for (std::int64_t i = 0; i < joints_; ++i) {
        const std::string prefix = "joint." + std::to_string(i) + ".";
        declare_all(prefix, joint_rows);
        if ((unlock_mask_ >> i & 1) != 0) {
            declare_all(prefix, unlock_rows);
        }
        if (i >= joints_ - extra_joints_) {
            declare(prefix + position_after_homing.name, position_after_homing);
        }
    }
}

void MotionModule::declare_digital_pins() {
    const Argument stated(*this, "num_dio", 0, "digital inputs and outputs",
                          {.min = 0, .max = max_pins});
    const TextArgument inputs(*this, "names_din", "", "names of digital inputs");
    const TextArgument outputs(*this, "names_dout", "", "names of digital outputs");
    const std::int64_t count = count_of(stated, inputs.get(), outputs.get());
    declare_list("motion.din-", "motion.digital-in-", inputs.get(), count, {"", bit, in});
    declare_list("motion.dout-", "motion.digital-out-", outputs.get(), count, {"", bit, out});
}

void MotionModule::declare_analog_pins() {
    const Argument stated(*this, "num_aio", 0, "analog inputs and outputs",
                          {.min = 0, .max = max_pins});
    const TextArgument inputs(*this, "names_ain", "", "names of analog inputs");
    const TextArgument outputs(*this, "names_aout", "", "names of analog outputs");
    const std::int64_t count = count_of(stated, inputs.get(), outputs.get());
    declare_list("motion.ain-", "motion.analog-in-", inputs.get(), count, {"", real, in});
    declare_list("motion.aout-", "motion.analog-out-", outputs.get(), count, {"", real, out});
}

void MotionModule::declare_errors() {
    const Argument stated(*this, "num_misc_error", 0, "inputs for errors",
                          {.min = -1, .max = max_pins});
    const TextArgument names(*this, "names_misc_errors", "", "names of inputs for errors");
    declare_list("motion.err-", "motion.misc-error-", names.get(), stated, {"", bit, in});
}

/// The period of servo-thread is a multiple of the base period, for which there is a thread of its
/// own where it is shorter.
void MotionModule::add_threads() const {
    const auto* const modules = extension<hal_modules>(HAL_MODULES);
    if (modules == nullptr) return;
    const bool has_base = base_period_ns_ > 0 && 2 * servo_period_ns_ >= 3 * base_period_ns_;
    if (!has_base) {
        modules->thread(detail::creating, "servo-thread", servo_period_ns_);
        return;
    }
    const std::int64_t ratio = (servo_period_ns_ + base_period_ns_ / 2) / base_period_ns_;
    modules->thread(detail::creating, "base-thread", base_period_ns_);
    modules->thread(detail::creating, "servo-thread", ratio * base_period_ns_);
}

}  // namespace hal
