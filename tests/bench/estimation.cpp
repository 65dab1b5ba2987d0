// SPDX-License-Identifier: MIT
// What a Kalman filter costs in a cycle: a thread on the virtual clock with it, less the same
// thread without.
#include <algorithm>
#include <fmt/core.h>
#include <stdexcept>

#include "bench.hpp"
#include "execute/core.hpp"
#include "runtime.hpp"

namespace hal::bench {
namespace {

/// Six states in a chain, three of them measured.
std::string filter(const char* age) {
    std::string a, c, q;
    for (int i = 0; i < 6; ++i) {
        for (int j = 0; j < 6; ++j) {
            a += fmt::format("{}{}",
                             j   ? ","
                             : i ? ";"
                                 : "",
                             i == j       ? 1.0
                             : j == i + 1 ? 0.001
                                          : 0.0);
        }
        q += " 1e-4";
    }
    for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 6; ++j) {
            c += fmt::format("{}{}", j ? "," : i ? ";" : "", j == 2 * i ? 1 : 0);
        }
    }
    return fmt::format(
        "loadrt kalman names=f a={} c={} qn=\"diag{}\" rn=\"diag 0.1 0.1 0.1\"\nsetp f.age-[0..2] "
        "{}\naddf f.update t\n",
        a, c, q, age);
}

/// ns of a cycle, the best of some runs.
double cycle_ns(const std::string& text, std::uint64_t cycles) {
    Runtime runtime(true);
    runtime.apply("newthread t 1000000\n" + text);
    runtime.session.threads().start();
    runtime.session.threads().advance_cycles(1000);
    double best = 1e18;
    for (int run = 0; run < 7; ++run) {
        const std::int64_t begin = monotonic_ns();
        runtime.session.threads().advance_cycles(cycles);
        best = std::min(best,
                        static_cast<double>(monotonic_ns() - begin) / static_cast<double>(cycles));
    }
    return best;
}

}  // namespace

void estimation(const Options& options, Report& report) {
    report.section("a Kalman filter in the cycle");
    const std::uint64_t cycles = options.quick ? 20'000 : 200'000;
    try {
        const double without = cycle_ns("", cycles);
        report.row({.what = "kalman, 6 states, 3 measurements",
                    .unit = "us",
                    .ours = (cycle_ns(filter("0"), cycles) - without) / 1000,
                    .goal = limit(2)});
        report.row({.what = "the same, each measurement 3 cycles late",
                    .unit = "us",
                    .ours = (cycle_ns(filter("0.003"), cycles) - without) / 1000});
    } catch (const std::runtime_error& problem) {
        report.note(fmt::format("not measured: {}", problem.what()));  // a build without Eigen
    }
}

}  // namespace hal::bench
