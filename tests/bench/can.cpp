// SPDX-License-Identifier: MIT
// CANopen over SocketCAN: SDO, SYNC and received PDOs, each side of ours against the other side
// without a stack (can_neutral.c), which is measured against itself in the same rounds. Where the
// kernel has no CAN, can_shim.c carries the frames.
#include <algorithm>
#include <fmt/core.h>
#include <linux/can.h>
#include <map>
#include <net/if.h>
#include <sstream>
#include <sys/socket.h>
#include <unistd.h>

#include "bench.hpp"
#include "machine.hpp"
#include "process.hpp"
#include "sample.hpp"

namespace hal::bench {
namespace {

/// Figures by name, one of each round.
class Figures {
public:
    void read(const std::string& text) {
        std::istringstream lines(text);
        std::string name;
        for (double value = 0; lines >> name;) {
            if (name == "ready") continue;
            if (!(lines >> value)) return;
            all_[name].push_back(value);
        }
    }
    /// The best round: the highest of rates, the lowest of times.
    std::optional<double> best(const std::string& name) const {
        const auto found = all_.find(name);
        if (found == all_.end()) return std::nullopt;
        const bool time = name.find("cpu") != name.npos || name.starts_with("sync");
        return time ? *std::min_element(found->second.begin(), found->second.end())
                    : *std::max_element(found->second.begin(), found->second.end());
    }
    std::optional<double> middle(const std::string& name) const {
        auto found = all_.find(name);
        if (found == all_.end()) return std::nullopt;
        std::vector<double> values = found->second;
        return median(values);
    }

private:
    std::map<std::string, std::vector<double>> all_;
};

constexpr const char* python_master = R"(import sys, time, canopen
network = canopen.Network()
network.connect(interface="socketcan", channel=sys.argv[1])
sdo = network.add_node(5, canopen.ObjectDictionary()).sdo
sdo.RESPONSE_TIMEOUT = 2.0
n = int(sys.argv[2])
for name, do in (("up", lambda: sdo.upload(0x2000, 0)), ("down", lambda: sdo.download(0x2000, 0, b"\1\2\3\4"))):
    begin, used = time.perf_counter(), time.process_time()
    for _ in range(n): do()
    print(f"exp_{name}", n / (time.perf_counter() - begin)); print(f"exp_{name}_cpu", (time.process_time() - used) / n * 1e6)
data = bytes(i * 7 & 255 for i in range(65536))
for block in (False, True):
    begin = time.perf_counter()
    with sdo.open(0x2001, 0, "wb", size=len(data), block_transfer=block) as f: f.write(data)
    print("blk64k_down" if block else "seg64k_down", len(data) / (time.perf_counter() - begin) / 1000)
    begin = time.perf_counter()
    with sdo.open(0x2001, 0, "rb", block_transfer=block) as f: back = f.read()
    print("blk64k_up" if block else "seg64k_up", len(back) / (time.perf_counter() - begin) / 1000)
)";

class Rig {
public:
    explicit Rig(const Options& options) : programs_(options.programs + "/"), cpu_(options.cpu) {
        const int probe = ::socket(AF_CAN, SOCK_RAW, CAN_RAW);
        if (probe >= 0) {
            ::close(probe);
        }
        if (const char* named = std::getenv("HALCYON_BENCH_CAN")) {
            interface_ = named;
        }
        real_ = probe >= 0 && if_nametoindex(interface_.c_str()) != 0;
        if (!real_) {
            interface_ = fmt::format("shim{}", getpid());
        }
        fifo_ = !find_program("chrt").empty() &&
                run({.arguments = {"chrt", "-f", "5", "true"}}).status == 0;
    }
    std::string about() const {
        return real_ ? "SocketCAN on " + interface_
                     : "raw CAN sockets over UDP on the loopback interface (can_shim.c), because "
                       "there is no SocketCAN interface " +
                           std::string("vcan0");
    }
    Start program(std::vector<std::string> words) const {
        Start start{.arguments = std::move(words), .everywhere = true};
        // Both sides on one CPU: what a wake-up across two costs is the machine's, and the same for
        // all.
        if (!find_program("taskset").empty()) {
            start.arguments.insert(start.arguments.begin(),
                                   {"taskset", "-c", std::to_string(cpu_)});
        }
        // Above what else the machine does, which would be measured instead.
        if (fifo_) {
            start.arguments.insert(start.arguments.begin(), {"chrt", "-f", "5"});
        }
        if (!real_) {
            start.environment.push_back("LD_PRELOAD=" + programs_ + "can_shim.so");
        }
        return start;
    }
    std::string ours() const { return programs_ + "can_stack"; }
    std::string neutral() const { return programs_ + "can_neutral"; }
    const std::string& interface() const { return interface_; }
    bool fifo() const { return fifo_; }

private:
    std::string programs_, interface_ = "vcan0";
    int cpu_;
    bool real_ = false;
    bool fifo_ = false;
};

/// Runs `master` beside `slave`.
std::string pair(const Start& slave, const Start& master) {
    Child beside(slave, true);
    for (const Stopwatch watch; beside.line(5000).value_or("ready") != "ready";) {
        if (watch.ms() > 5000) break;
    }
    return run(master, 120'000).out;
}

/// The figures of each pair, over all rounds.
struct Measured {
    /// no stack at either side, our master, our device, no wire, Python's master
    Figures reference, master, slave, memory, foreign;
    int rounds = 0;
    std::string python;  ///< foreign was measured with it
};

Measured measure(const Options& options, const Rig& rig) {
    const std::string part = options.quick ? "4" : "1", count = options.quick ? "10000" : "40000",
                      &name = rig.interface();
    const Start neutral_slave = rig.program({rig.neutral(), name, "slave"});

    const Start our_slave = rig.program({rig.ours(), "can:" + name, "slave"});
    const Start neutral_master = rig.program({rig.neutral(), name, "master", part});

    const Start our_master = rig.program({rig.ours(), "can:" + name, "master", part});
    const TemporaryFolder files;
    const std::string script = files.file("master.py", python_master);
    Measured all;
    all.rounds = options.quick ? 2 : 5;
    all.python = find_python("can, canopen");
    for (int n = 0; n < all.rounds; ++n) {
        all.reference.read(pair(neutral_slave, neutral_master));
        all.master.read(pair(neutral_slave, our_master));
        all.slave.read(pair(our_slave, neutral_master));
        for (const auto& [words, figures] :
             {std::pair{std::vector{rig.ours(), "can:" + name}, &all.master},
              std::pair{std::vector{rig.neutral(), name}, &all.reference}}) {
            Child receiver(rig.program({words[0], words[1], "receive", count}), true);
            receiver.line(5000);
            run(rig.program({rig.neutral(), name, "generate", count, "100000"}), 60'000);
            std::string text;
            while (const auto line = receiver.line(3000)) {
                text += *line + "\n";
                if (line->starts_with("receive_cpu")) break;
            }
            figures->read(text);
        }
        all.memory.read(run({.arguments = {rig.ours(), "memory", part}, .everywhere = true}).out);
        if (!all.python.empty()) {
            all.foreign.read(pair(neutral_slave, rig.program({all.python, script, name,
                                                              options.quick ? "500" : "2000"})));
        }
    }
    return all;
}

/// Master and device against the program without a stack.
void tell_beside(const Measured& all, Report& report) {
    constexpr double beside = 1.15;
    const auto row = [&](const std::string& what, const Figures& ours, const std::string& figure,
                         const std::string& unit, Goal goal) {
        report.row({.what = what,
                    .unit = unit,
                    .ours = ours.best(figure),
                    .peer = "no stack",
                    .theirs = all.reference.best(figure),
                    .goal = goal});
    };
    const auto both = [&](const std::string& what, const std::string& figure,
                          const std::string& unit, Goal goal) {
        if (all.master.best(figure)) {
            row("master: " + what, all.master, figure, unit, goal);
        }
        if (all.slave.best(figure)) {
            row("device: " + what, all.slave, figure, unit, goal);
        }
    };
    both("SDO expedited upload", "exp_up", "/s", at_least(80'000, beside));
    both("SDO expedited download", "exp_down", "/s", at_least(80'000, beside));
    both("SDO segmented download, 1 MiB", "seg1m_down", "kB/s", at_least(650, beside));
    both("SDO segmented upload, 1 MiB", "seg1m_up", "kB/s", at_least(650, beside));
    both("SDO block download, 1 MiB", "blk1m_down", "kB/s", at_least(1500, beside));
    both("SDO block upload, 1 MiB", "blk1m_up", "kB/s", at_least(1500, beside));
    row("master: CPU of an expedited upload", all.master, "exp_up_cpu", "us", limit(6, beside));
    row("master: CPU of an expedited download", all.master, "exp_down_cpu", "us", limit(6, beside));
    both("SYNC to TPDO in the application, p50", "sync_p50", "us", limit(35, beside));
    both("SYNC to TPDO in the application, p99", "sync_p99", "us", limit(70, beside));
    row("master: CPU of a cycle of SYNC and TPDO, 1 kHz", all.master, "sync_cpu", "us",
        limit(38, beside));
    row("master: CPU of a received PDO, 10 kHz", all.master, "receive_cpu", "us", limit(8, beside));
}

void tell_without_wire(const Measured& all, Report& report) {
    for (const auto& [figure, what] : {std::pair{"blk_down", "block download"},
                                       {"blk_up", "block upload"},
                                       {"seg_down", "segmented download"},
                                       {"seg_up", "segmented upload"}}) {
        for (const auto& [bus, where] :
             {std::pair{"sim_", "bus in memory"}, {"memory_", "queue to queue"}}) {
            report.row({.what = fmt::format("{}: SDO {}, 1 MiB", where, what),
                        .unit = "kB/s",
                        .ours = all.memory.best(std::string(bus) + figure),
                        .goal = figure[0] == 'b' ? at_least(5000) : Goal{}});
        }
    }
    report.row({.what = "queue to queue: SDO expedited, both sides",
                .unit = "/s",
                .ours = all.memory.best("memory_exp_up")});
}

void tell_beside_python(const Measured& all, Report& report) {
    if (all.python.empty()) {
        return report.note(
            "no Python with the packages canopen and python-can; ./hal test installs them, "
            "HALCYON_PYTHON names one");
    }
    for (const auto& [figure, what] : {std::pair{"exp_up", "expedited upload, /s"},
                                       {"exp_up_cpu", "its CPU, us"},
                                       {"seg64k_down", "segmented download, 64 KiB, kB/s"},
                                       {"blk64k_down", "block download, 64 KiB, kB/s"},
                                       {"blk64k_up", "block upload, 64 KiB, kB/s"}}) {
        report.row({.what = fmt::format("master: SDO {}", what),
                    .unit = "",
                    .ours = all.master.best(figure),
                    .peer = "Python canopen",
                    .theirs = all.foreign.best(figure)});
    }
}

}  // namespace

void can(const Options& options, Report& report) {
    report.section("CANopen: one node, no pacing of the bus");
    const Rig rig(options);
    if (access(rig.ours().c_str(), X_OK) != 0 || access(rig.neutral().c_str(), X_OK) != 0) {
        return report.note("can_stack and can_neutral are not built here");
    }
    const Measured all = measure(options, rig);
    tell_beside(all, report);
    tell_without_wire(all, report);
    tell_beside_python(all, report);
    report.note(
        "lely-core and CANopenNode are not installed as programs; docs/performance-figures.md has "
        "their figures by the same method.");
    report.note(fmt::format(
        "Over {}. Both sides on one CPU{}. Best of {} rounds, all pairs in turn; median of the "
        "same rounds: SDO upload {:.0f}/s "
        "(no stack {:.0f}/s), SYNC p50 {:.1f} us ({:.1f} us).",
        rig.about(), rig.fifo() ? ", SCHED_FIFO" : "", all.rounds,
        all.master.middle("exp_up").value_or(0), all.reference.middle("exp_up").value_or(0),
        all.master.middle("sync_p50").value_or(0), all.reference.middle("sync_p50").value_or(0)));
}

}  // namespace hal::bench
