// SPDX-License-Identifier: MIT
// What a trace costs the cycles that it records.
#include <fmt/core.h>
#include <thread>

#include "bench.hpp"
#include "machine.hpp"
#include "runtime.hpp"
#include "sample.hpp"

namespace hal::bench {
namespace {

struct Cycles {
    double median_ns = 0;
    std::uint64_t lost = 0;
};

/// A thread of 1 kHz with so many functions, recorded or not.
Cycles run(const Options& options, int functions, bool traced, double seconds) {
    Runtime runtime;
    std::string netlist = new_thread("servo", 1'000'000, options.cpu, "spin=0") +
                          fmt::format("loadrt sum2 count={}\n", functions);
    for (int i = 0; i < functions; ++i) {
        netlist += fmt::format("addf sum2.{} servo\n", i);
    }
    runtime.apply(netlist);
    if (traced) {
        runtime.session.traces().begin();
    }
    runtime.session.threads().start();
    Cycles seen;
    for (const Stopwatch watch; watch.ms() < seconds * 1000;) {
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
        if (!traced) continue;
        for (const TraceBatch::Part& part : runtime.session.traces().take().parts) {
            seen.lost += part.lost;
        }
    }
    seen.median_ns = runtime.session.reports().threads().front().busy_p50_ns;
    runtime.session.threads().stop();
    return seen;
}

}  // namespace

void trace(const Options& options, Report& report) {
    constexpr int functions = 100;
    const double seconds = options.quick ? 1 : 5;
    report.section("Trace: each function of each cycle recorded");
    const Cycles off = run(options, functions, false, seconds);

    const Cycles on = run(options, functions, true, seconds);
    report.row(
        {fmt::format("cycle of {} functions, no trace, median", functions), "ns", off.median_ns});
    report.row({"the same, traced", "ns", on.median_ns, "no trace", off.median_ns});
    report.row({"per function", "ns", (on.median_ns - off.median_ns) / functions});
    report.row({"lost events", "", static_cast<double>(on.lost), "", {}, limit(0)});
}

}  // namespace hal::bench
