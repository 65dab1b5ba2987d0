// SPDX-License-Identifier: MIT
// What a netlist costs from text to threads that run it: does it grow with its size and no faster?
#include <fmt/core.h>

#include "bench.hpp"
#include "linuxcnc.hpp"
#include "machine.hpp"
#include "runtime.hpp"
#include "sample.hpp"

namespace hal::bench {
namespace {

/// So many nets, each from one gate to the next.
std::string chain(std::size_t nets) {
    std::string text = fmt::format("loadrt and2 count={}\n", nets + 1);
    for (std::size_t i = 0; i < nets; ++i) {
        text += fmt::format("net n{} and2.{}.out => and2.{}.in0\n", i, i, i + 1);
    }
    for (std::size_t i = 0; i <= nets; ++i) {
        text += fmt::format("addf and2.{} t\n", i);
    }
    return text;
}

/// So many instances with twice as many nets: pairs of a minmax and a sum2 in a row, and the
/// resets.
std::string pairs(std::size_t instances) {
    const std::size_t n = instances / 2;
    std::string text = fmt::format("loadrt minmax count={0}\nloadrt sum2 count={0}\n", n);
    for (std::size_t i = 0; i < n; ++i) {
        text += fmt::format(
            "net a{0} minmax.{0}.max => sum2.{0}.in0\nnet b{0} minmax.{0}.min => sum2.{0}.in1\n"
            "net c{0} sum2.{0}.out => minmax.{1}.in\nnet d{0} minmax.{0}.reset\naddf minmax.{0} "
            "t\naddf sum2.{0} t\n",
            i, (i + 1) % n);
    }
    return text;
}

/// The best of some runs: other work on the machine can only make it longer.
Applied measure(const Options& options, const std::string& netlist, int runs) {
    Applied best;
    for (int i = 0; i < runs; ++i) {
        Runtime runtime;
        runtime.apply(new_thread("t", 1'000'000, options.cpu));
        const Applied cost = runtime.apply(netlist);
        if (i == 0 || cost.cpu < best.cpu) {
            best = cost;
        }
    }
    return best;
}

std::optional<double> linuxcnc(const std::string& netlist) {
    const auto peer = LinuxCnc::start("name1=t period1=1000000");
    if (!peer) return std::nullopt;
    const Finished finished = peer->file(netlist);
    return finished.status == 0 ? std::optional(finished.ms) : std::nullopt;
}

}  // namespace

void load(const Options& options, Report& report) {
    report.section("load: from text to a 1 ms thread that runs it");
    std::vector<std::pair<std::size_t, Applied>> costs;
    for (const std::size_t nets : {100u, 1000u, 10'000u, 100'000u}) {
        if (options.quick && nets > 10'000) break;
        const Applied cost = measure(options, chain(nets), nets > 10'000 ? 2 : 5);
        costs.emplace_back(nets, cost);
        const bool fits = nets <= 1000;  // LinuxCNC's shared memory
        const auto peer = fits ? linuxcnc(chain(nets)) : std::nullopt;
        report.row({.what = fmt::format("{} nets and gates", nets),
                    .unit = "ms",
                    .ours = cost.all(),
                    .peer = !fits  ? ""
                            : peer ? LinuxCnc::name()
                                   : LinuxCnc::absent(),
                    .theirs = peer});
        report.note(
            fmt::format("parse {:.1f}, apply {:.1f}, check, compile and swap {:.1f} ms; processor "
                        "time of all {:.1f} ms, {:.2f} us per net",
                        cost.parse, cost.apply, cost.commit, cost.cpu,
                        cost.cpu * 1000 / static_cast<double>(nets)));
    }
    const auto& [few, small] = costs[1];
    const auto& [many, large] = costs.back();
    report.row(
        {.what = fmt::format("growth from {} to {} nets: processor time ~ nets ^ b, b", few, many),
         .unit = "",
         .ours =
             exponent(static_cast<double>(few), small.cpu, static_cast<double>(many), large.cpu),
         .goal = limit(1.25)});
    report.row({.what = "10 000 instances, 20 000 nets",
                .unit = "ms",
                .ours = measure(options, pairs(10'000), 3).all(),
                .goal = limit(1000)});
    report.note("b: 1 is linear, 2 quadratic; what no longer fits the caches adds to 1.");
    report.note(
        "LinuxCNC: halcmd -f of the same text, its start included; it cannot hold more than some "
        "1200 gates.");
}

}  // namespace hal::bench
