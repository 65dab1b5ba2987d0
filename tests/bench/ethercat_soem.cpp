// SPDX-License-Identifier: MIT
#include "ethercat_soem.hpp"

#include <cstdio>

#include "ethercat_wire.hpp"
#include "machine.hpp"
#include "process.hpp"

namespace hal::bench {
namespace {

/// A program of SOEM by its Python package: the same drives with the PDOs they have by default, the
/// time of the reference clock in each frame.
constexpr const char* soem_program = R"(import sys, time, pysoem
master = pysoem.Master()
master.open(sys.argv[1])
began = time.perf_counter()
if master.config_init() < 1: sys.exit("no slaves")
master.config_map()
master.config_dc()
cycle = 1_000_000
for slave in master.slaves: slave.dc_sync(True, cycle)
master.state = pysoem.SAFEOP_STATE
master.write_state()
master.state_check(pysoem.SAFEOP_STATE, 5_000_000)
master.state = pysoem.OP_STATE
master.write_state()
for n in range(5000):
    master.send_processdata()
    master.receive_processdata(2000)
    if n % 10 == 0 and master.state_check(pysoem.OP_STATE, 1000) == pysoem.OP_STATE: break
    time.sleep(0.001)
print("ready", (time.perf_counter() - began) * 1e3, flush=True)
input()
def measure(count, paced):
    wall, cpu, due = [], [], time.perf_counter_ns() + cycle
    for n in range(count):
        if paced:
            time.sleep(max(0, due - time.perf_counter_ns()) * 1e-9)
            due += cycle
        c, w = time.thread_time_ns(), time.perf_counter_ns()
        master.send_processdata()
        master.receive_processdata(2000)
        wall.append(time.perf_counter_ns() - w)
        cpu.append(time.thread_time_ns() - c)
    return sorted(wall)[count // 2] / 1e3, sorted(cpu)[count // 2] / 1e3
hot, paced = measure(5000, False), measure(1000, True)
print(*hot, *paced, flush=True)
)";

Soem without(const char* why) {
    Soem result;
    result.why = why;
    return result;
}

}  // namespace

Soem soem(const Options& options, const std::string& here, const std::string& there,
          const std::string& line) {
    const int last = options.cpu, other = last > 0 ? last - 1 : last;
    const std::string python = find_python("pysoem");
    const std::string chrt = find_program("chrt");

    const std::string taskset = find_program("taskset");
    if (python.empty()) {
        return without("no Python with pysoem; ./hal test installs it, HALCYON_PYTHON names one");
    }
    if (chrt.empty() || taskset.empty()) return without("chrt or taskset is missing");
    Slaves slaves(there, line);
    slaves.start(Slaves::Mode::emulated, other);
    const TemporaryFolder folder;
    Child child({{taskset, "-c", std::to_string(last), chrt, "-f", std::to_string(priority), python,
                  folder.file("soem.py", soem_program), here},
                 {},
                 static_cast<uid_t>(-1),
                 true},
                true);
    const auto first = child.line(60'000);
    if (!first) return without("it did not bring them to OP");
    Soem result;
    if (double ms = 0; std::sscanf(first->c_str(), "ready %lf", &ms) == 1) {
        result.start_ms = ms;
    }
    slaves.start(Slaves::Mode::null, last);
    child.write("\n");
    double wall = 0;
    double cpu = 0;
    double paced = 0;
    double ignored = 0;
    const auto second = child.line(60'000);
    if (second &&
        std::sscanf(second->c_str(), "%lf %lf %lf %lf", &wall, &cpu, &paced, &ignored) == 4) {
        result.wall = wall;
        result.cpu = cpu;
        result.paced = paced;
    } else {
        result.why = "it ended early";
    }
    return result;
}

}  // namespace hal::bench
