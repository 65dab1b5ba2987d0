// SPDX-License-Identifier: MIT
// A module that follows a clock outside adjusts the deadlines of the threads. One component of a
// machine does so: extension hal.clock/1.
#include <cerrno>

#include "linuxcnc/binary/module.hpp"
#include "linuxcnc/binary/tasks.hpp"

namespace hal::modules {
namespace {

const hal_clock* clock_of_threads = nullptr;
const Module* leader = nullptr;
// LinuxCNC adds the correction to every period until it is changed. Both are of the thread that has
// set it.
long correction_ns = 0;
const hal_cycle* corrected = nullptr;
// Whether the function that the thread runs, or has run last of those with this import, belongs to
// the leader.
constinit thread_local bool leads __attribute__((tls_model("initial-exec"))) = false;

}  // namespace

void take_clock(Module& module, const hal_host* host) {
    if (!module.imports("rtapi_task_pll_set_correction")) return;
    clock_of_threads = static_cast<const hal_clock*>(host->extension(host, "hal.clock/1"));
    if (clock_of_threads && clock_of_threads->claim(clock_of_threads, host)) {
        leader = &module;
    } else {
        rtapi_print_msg(RTAPI_MSG_WARN,
                        "%s: the threads follow another component's clock: "
                        "rtapi_task_pll_set_correction() fails\n",
                        module.name().c_str());
    }
    correction_ns = 0;
    corrected = nullptr;
}

void release_clock(const Module& module) noexcept {
    if (leader == &module) {
        leader = nullptr;
    }
}

void adjust_clock(const Module& module, const hal_cycle& cycle) noexcept {
    static std::uint64_t adjusted = 0;  // number of the cycle
    leads = &module == leader;
    if (!leads || corrected != &cycle || adjusted == cycle.number) return;
    adjusted = cycle.number;
    if (correction_ns != 0) {
        clock_of_threads->step(clock_of_threads, correction_ns);
    }
}

}  // namespace hal::modules

using namespace hal::modules;

extern "C" {

int rtapi_task_pll_set_correction(long value) {
    if (correct_task(value)) return 0;
    if (!in_cycle || !leader || !leads) return -EINVAL;
    // this cycle has the old one
    const long change = corrected == cycle_now ? value - correction_ns : value;
    correction_ns = value;
    corrected = cycle_now;
    clock_of_threads->step(clock_of_threads, change);
    return 0;
}
}
