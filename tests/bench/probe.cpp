// SPDX-License-Identifier: MIT
// What probes cost the cycle that they look at, and whether they lose rows at a real rate.
#include <fmt/core.h>
#include <thread>

#include "bench.hpp"
#include "execute/core.hpp"
#include "hal/clock.hpp"
#include "machine.hpp"
#include "runtime.hpp"
#include "sample.hpp"

namespace hal::bench {
namespace {

std::string netlist(int values, std::string_view thread, std::string_view prefix) {
    std::string text = fmt::format("loadrt sum2 names={0}0", prefix);
    for (int i = 1; i < values; ++i) {
        text += fmt::format(",{}{}", prefix, i);
    }
    text += '\n';
    for (int i = 0; i < values; ++i) {
        text += fmt::format(
            "setp {0}{1}.in0 1\nnet {0}sum{1} {0}{1}.out => {0}{1}.in1\naddf {0}{1} {2}\n", prefix,
            i, thread);
    }
    return text;
}

std::vector<std::string> names(int values, std::string_view prefix) {
    std::vector<std::string> all;
    for (int i = 0; i < values; ++i) {
        all.push_back(fmt::format("{}sum{}", prefix, i));
    }
    return all;
}

/// Sampling 64 values, ns, when the cycle before has just run: the best of many medians.
double cost_ns(int values) {
    std::vector<hal_value> slots(4096);
    plan::ProbeRing ring(static_cast<std::size_t>(values), 1 << 12, 1);
    std::vector<const hal_value*> from;
    // of an image of 4096 values
    for (int i = 0; i < values; ++i) {
        from.push_back(&slots[static_cast<std::size_t>(i) * 29 % slots.size()]);
    }
    double best = 1e9;
    std::uint64_t cycle = 0;
    for (int run = 0; run < 50; ++run) {
        constexpr int rows = 1000;
        const std::int64_t begin = monotonic_ns();
        for (int i = 0; i < rows; ++i, ++cycle) {
            ring.sample(cycle, static_cast<std::int64_t>(cycle), from.data());
        }
        best = std::min(best, static_cast<double>(monotonic_ns() - begin) / rows);
        ring.drop(ring.size());
    }
    return best;
}

struct Live {
    std::uint64_t rows = 0;
    std::uint64_t lost = 0;
    std::uint64_t missed = 0;
};

/// 64 values at 1 kHz and 16 at 10 kHz for some time, taken every 20 ms as the server takes them.
Live at_a_real_rate(const Options& options, double seconds) {
    Runtime runtime;
    runtime.apply(new_thread("fast", 100'000, options.cpu, "spin=0") +
                  fmt::format("newthread slow 1000000 cpu={} priority={} spin=0\n", options.cpu,
                              priority - 1) +
                  netlist(16, "fast", "f") + netlist(64, "slow", "s"));
    runtime.session.threads().start();
    std::vector<std::string> all = names(16, "f");
    for (std::string& name : names(64, "s")) {
        all.push_back(std::move(name));
    }
    const auto missed = [&] {
        std::uint64_t sum = 0;
        for (const ThreadReport& thread : runtime.session.reports().threads()) {
            sum += thread.missed;
        }
        return sum;
    };
    Live live;
    const std::uint64_t before = missed();
    std::string problem;
    const auto probe = runtime.session.probes().attach({all}, problem);
    if (!probe) throw std::runtime_error(problem);
    const Stopwatch watch;
    while (watch.ms() < seconds * 1000) {
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
        for (const ProbeRows& rows : runtime.session.probes().take(*probe)) {
            for (const auto& part : rows.parts) {
                live.rows += part.rows;
            }
        }
    }
    live.lost = Probes::lost(*probe);
    runtime.session.probes().detach(probe);
    live.missed = missed() - before;
    runtime.session.threads().stop();
    return live;
}

}  // namespace

void probe(const Options& options, Report& report) {
    report.section("Probes: values sampled at the end of every cycle");
    double many = 0;
    double few = 0;
    run_real_time(options.cpu, [&] {
        many = cost_ns(64);
        few = cost_ns(1);
    });
    report.row({"64 values, in the cycle", "ns", many, "the reach", 200.0, limit(200)});
    report.row({"1 value, in the cycle", "ns", few});
    const double seconds = options.quick ? 2 : 20;
    const Live live = at_a_real_rate(options, seconds);
    report.row({fmt::format("16 values at 10 kHz and 64 at 1 kHz for {:g} s: lost rows", seconds),
                "",
                static_cast<double>(live.lost),
                "",
                {},
                limit(0)});
    report.note(fmt::format("{} rows; attached and detached live: {} periods missed meanwhile",
                            live.rows, live.missed));
}

}  // namespace hal::bench
