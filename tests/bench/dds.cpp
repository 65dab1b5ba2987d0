// SPDX-License-Identifier: MIT
// DDS: what publishing 64 pins costs in a cycle, and how long a sample of 64 pins is on its way
// from one process to another, beside a bare Fast DDS writer and reader in turn in the same run.
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fmt/core.h>
#include <stdexcept>

#include "bench.hpp"
#include "execute/core.hpp"
#include "process.hpp"
#include "runtime.hpp"
#include "sample.hpp"

namespace hal::bench {
namespace {

/// Time of the processor that a cycle of a thread on the virtual clock takes, the best of 40 runs;
/// those in which `dropped` counted are none: a sample that finds no place in the queue costs less
/// than one that is stored.
double cycle_ns(const std::string& text, std::uint64_t cycles,
                const std::vector<std::string>& dropped = {}) {
    Runtime runtime(true);
    runtime.apply("newthread t 1000000\n" + text);
    runtime.session.threads().start();
    runtime.session.threads().advance_cycles(100);
    const auto lost = [&] {
        return dropped.empty() ? 0 : runtime.session.values().read(dropped).at(0).value().value.u64;
    };
    double best = 1e18;
    for (int run = 0, good = 0; good < 40 && run < 400; ++run) {
        usleep(20'000);  // the queue has 64 places, which the DDS thread empties meanwhile
        const auto before = lost();
        const CpuStopwatch watch;
        runtime.session.threads().advance_cycles(cycles);
        const double ns = watch.ms() * 1e6 / static_cast<double>(cycles);
        if (lost() != before) continue;
        best = std::min(best, ns);
        ++good;
    }
    if (best == 1e18) {
        throw std::runtime_error(
            "the DDS thread never emptied its queue: this machine is too busy to measure");
    }
    return best;
}

struct Times {
    double samples = 0;
    double lost = 0;
    double p50 = 0;
    double p99 = 0;
    double max = 0;
};

/// One exchange of `count` samples at 1 kHz.
Times exchange(const Options& options, bool ours, long count, int domain) {
    const std::string peer = options.programs + "/dds_peer";
    const std::string number = std::to_string(domain);

    const std::string wanted = std::to_string(count);
    Child reader(
        {{peer, ours ? "halcyon-read" : "read", wanted, number}, {}, static_cast<uid_t>(-1), true},
        true);
    if (reader.line(20'000) != "ready") throw std::runtime_error("dds_peer does not start");
    TemporaryFolder folder;
    const std::string netlist = folder.file(
        "pins.hal",
        fmt::format("loadrt threads name1=servo period1=1000000\nloadrt dds_publish names=pub "
                    "topic=bench/pins "
                    "type=bench::Pins fields=v:float*64 rate=0 domain={}\naddf pub servo\n",
                    domain));
    Child writer(ours ? Start{{options.programs + "/hal", "run", "--name", "bench-dds", netlist},
                              {},
                              static_cast<uid_t>(-1),
                              true}
                      : Start{{peer, "write", wanted, number}, {}, static_cast<uid_t>(-1), true});
    const auto line = reader.line(static_cast<int>(count) * 2 + 20'000);
    Times t;
    if (!line ||
        std::sscanf(line->c_str(), "%lf %lf %lf %lf %lf", &t.samples, &t.lost, &t.p50, &t.p99,
                    &t.max) != 5 ||
        t.samples < 1) {
        throw std::runtime_error("no samples came");
    }
    return t;
}

}  // namespace

void dds(const Options& options, Report& report) {
    report.section("DDS, 64 pins of type float");
    if (!std::filesystem::exists(options.programs + "/dds_peer")) {
        return report.note("not measured: this build is without Fast DDS");
    }
    const std::uint64_t cycles = 50;
    const double without = cycle_ns("", cycles);
    const double with = cycle_ns(
        "loadrt dds_publish names=p topic=bench/cost fields=v:float*64 rate=0 domain=231\naddf p "
        "t\n",
        cycles, {"p.dropped"});
    report.row({.what = "publishing in the cycle",
                .unit = "ns",
                .ours = with - without,
                .goal = limit(150)});

    const int rounds = options.quick ? 2 : 5;
    const long count = options.quick ? 1000 : 3000;
    std::vector<double> p50[2], p99[2];
    double lost[2] = {}, max[2] = {};
    for (int round = 0; round < rounds; ++round) {
        for (const int ours : {1, 0}) {
            const Times t = exchange(options, ours == 1, count, 200 + round);
            p50[ours].push_back(t.p50);
            p99[ours].push_back(t.p99);
            lost[ours] += t.lost + static_cast<double>(count) - t.samples;
            max[ours] = std::max(max[ours], t.max);
        }
    }
    const char* peer = "bare Fast DDS";
    report.row({.what = "publish to subscribe, 1 kHz, p50",
                .unit = "us",
                .ours = median(p50[1]),
                .peer = peer,
                .theirs = median(p50[0]),
                .goal = at_most(1.3)});
    report.row({.what = "the same, p99",
                .unit = "us",
                .ours = median(p99[1]),
                .peer = peer,
                .theirs = median(p99[0]),
                .goal = at_most(1.3)});
    report.row({.what = "the same, greatest",
                .unit = "us",
                .ours = max[1],
                .peer = peer,
                .theirs = max[0]});
    report.row({.what = fmt::format("lost of {}, reliable", rounds * count),
                .unit = "",
                .ours = lost[1],
                .peer = peer,
                .theirs = lost[0],
                .goal = limit(0.5)});
    report.note(
        "from when the cycle was due, its wake-up included, until the sample is decoded and in the "
        "subscriber's mailbox; pins show it in "
        "the next cycle");
}

}  // namespace hal::bench
