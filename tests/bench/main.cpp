// SPDX-License-Identifier: MIT
// ./hal bench [--quick] [--full] [SECTION…]
#include <cstring>
#include <exception>
#include <filesystem>
#include <fmt/core.h>

#include "bench.hpp"
#if HALCYON_PACKAGE_ETHERCAT
#include "ethercat.hpp"
#endif
#include "ethernet.hpp"
#include "linuxcnc.hpp"
#include "machine.hpp"
#if HALCYON_PACKAGE_MESA
#include "mesa.hpp"
#endif
#include "sample.hpp"
#include "scocan.hpp"
#include "tdma.hpp"

namespace {

using namespace hal::bench;

struct Section {
    const char* name;
    const char* what;
    void (*run)(const Options&, Report&);
    bool ordinary = false;  ///< measures ordinary threads: must not run with real-time priority
};

constexpr Section sections[] = {
    {"dispatch", "cost of a function in a thread of 1000, against a hand-written loop and LinuxCNC",
     dispatch},
    {"modules", "cost of a function of LinuxCNC's compiled modules, here and in LinuxCNC", modules},
    {"wakeup", "how late threads wake, against cyclictest", wakeup},
    {"load", "100 to 100 000 nets, from text to running threads, against LinuxCNC", load, true},
    {"shell", "one-shot commands, a thousand setp, save, against halcmd", shell, true},
    {"edit", "live edits: missed periods, delay, a hundred thousand of them", edit, true},
    {"probe", "sampling values in the cycle: cost, and lost rows at 10 kHz", probe},
    {"journal", "the execution journal in a cycle of 1000 functions, beside a recording", journal},
    {"trace", "each function of each cycle recorded: cost, and lost events", trace},
    {"coherence", "whether a slow thread sees one state of a fast one, against LinuxCNC",
     coherence},
    {"python", "a component of 100 pins in Python", python, true},
    {"can",
     "CANopen over SocketCAN: SDO, SYNC and PDOs, against a plain raw socket program and the "
     "Python package",
     can, true},
    {"ethernet",
     "raw Ethernet over a veth pair: round trips and one-way times, against a plain socket program",
     raw_ethernet},
#if HALCYON_PACKAGE_TDMA
    {"tdma",
     "slot jitter of a station whose clock is 200 ppm off, and a backup master that takes over",
     time_slots},
#endif
#if HALCYON_PACKAGE_SCOCAN
    {"scocan",
     "time slots on a CAN bus in memory: error of a slot's begin, idle slots used, throughput, "
     "speed of the simulation",
     scocan},
#endif
#if HALCYON_PACKAGE_TDMA
    {"cnc",
     "five axes and 64 I/O over TDMA: refresh, round trip, CPU, most axes and shortest cycle", cnc},
#endif
#if HALCYON_PACKAGE_ETHERCAT
    {"ethercat",
     "50 EtherCAT drives over a veth pair against a plain socket program; start, faults, and how "
     "many slaves in memory",
     ethercat},
#endif
#if HALCYON_PACKAGE_MESA
    {"mesa", "read and write of the driver of a Mesa card, against a bare UDP loop", mesa_card},
#endif
    {"estimation", "a Kalman filter of 6 states and 3 measurements", estimation, true},
    {"vision", "markers in frames of 640 x 480: error and time", vision, true},
    {"dds", "64 pins from process to process, against a bare Fast DDS writer", dds},
    {"size",
     "of the program; with --full fresh clones of this commit and an earlier one: first motion, "
     "complete build and test, memory",
     size},
#if HALCYON_PACKAGE_CANOPEN
    {"canopen-boot", "a CANopen network of 127 nodes, in memory and on vcan", canopen_boot},
#endif
};

int usage(const char* problem, const char* word) {
    if (*problem) {
        fmt::print(stderr, "hal-bench: {}'{}'\n", problem, word);
    }
    fmt::print(stderr,
               "hal-bench [--quick] [--full] [SECTION...]   prints figures, asserts nothing\n"
               "  --quick  shorter runs\n  --full   also what takes minutes: builds of a fresh "
               "clone, a million edits\n");
    for (const Section& section : sections) {
        fmt::print(stderr, "  {:13}{}\n", section.name, section.what);
    }
    return *problem ? 2 : 0;
}

void run(const Section& section, const Options& options, Report& report) {
    fmt::print(stderr, "{} ", section.name);
    const Stopwatch watch;
    const double stolen = stolen_ms();
    try {
        if (section.ordinary) {
            run_undisturbed([&] { section.run(options, report); });
        } else {
            section.run(options, report);
        }
    } catch (const std::exception& problem) {
        report.note(fmt::format("{} ended early: {}", section.name, problem.what()));
    }
    report.note(fmt::format("took {:.1f} s, of which the hypervisor kept {:.0f} ms of CPU time",
                            watch.ms() / 1000, stolen_ms() - stolen));
    fmt::print(stderr, "{:.1f} s\n", watch.ms() / 1000);
}

}  // namespace

int main(int argc, char** argv) {
#if HALCYON_PACKAGE_CANOPEN
    if (argc == 2 && std::strcmp(argv[1], canopen_boot_inside_word) == 0) {
        return canopen_boot_inside();
    }
#endif
    Options options;
    std::vector<const Section*> wanted;
    for (int i = 1; i < argc; ++i) {
        const Section* found = nullptr;
        for (const Section& section : sections) {
            if (std::strcmp(argv[i], section.name) == 0) {
                found = &section;
            }
        }
        if (found) {
            wanted.push_back(found);
        } else if (std::strcmp(argv[i], "--quick") == 0) {
            options.quick = true;
        } else if (std::strcmp(argv[i], "--full") == 0) {
            options.full = true;
        } else if (std::strcmp(argv[i], "--help") == 0 || std::strcmp(argv[i], "-h") == 0) {
            return usage("", "");
        } else {
            return usage("no section or option ", argv[i]);
        }
    }
    if (wanted.empty()) {
        for (const Section& section : sections) {
            wanted.push_back(&section);
        }
    }
    options.programs = std::filesystem::read_symlink("/proc/self/exe").parent_path().string();
    options.cpu = real_time_cpu();

    Report report;
    report.section("machine");
    for (const auto& fact : machine_facts(options.cpu)) {
        report.note(fact);
    }
    stay_off(options.cpu);
    // enters the namespace that all threads and programs of the bench are to share
    LinuxCnc::absent();
    const Stopwatch watch;
    for (const Section* const section : wanted) {
        run(*section, options, report);
    }
    fmt::print("{}\n{:.0f} s in all\n", report.text(), watch.ms() / 1000);
    return 0;
}
