// SPDX-License-Identifier: MIT
// Edits of a running machine: do they cost its threads a cycle, and how soon are they there?
#include <fmt/core.h>
#include <thread>

#include "bench.hpp"
#include "machine.hpp"
#include "runtime.hpp"
#include "sample.hpp"

namespace hal::bench {
namespace {

std::string gates(std::size_t count) {
    std::string text = fmt::format("loadrt and2 count={}\n", count);
    for (std::size_t i = 0; i < count; ++i) {
        text += fmt::format("addf and2.{} t\n", i);
    }
    return text;
}

/// Every kind of live edit, each reverted by the next.
constexpr const char* edits[] = {
    "net live and2.10.out => and2.20.in0\n",
    "delsig live\n",
    "delf and2.500 t\n",
    "addf and2.500 t 500\n",
    "setp and2.7.in1 1\n",
    "setp and2.7.in1 0\n",
};

struct Counts {
    std::uint64_t cycles, missed;
};

Counts counts(Runtime& runtime) {
    const ThreadReport report = runtime.session.reports().threads().front();
    return {report.cycles, report.missed};
}

void live(const Options& options, Report& report) {
    Runtime runtime;
    runtime.apply(new_thread("t", 1'000'000, options.cpu) + gates(1000));
    runtime.session.threads().start();
    std::vector<double> missed_idle, missed_edited, visible, cost;
    std::size_t done = 0;
    const Stopwatch all;
    // windows with and without edits in turn: what the hypervisor does, it does to both
    for (int window = 0; window < (options.quick ? 4 : 16); ++window) {
        const bool editing = window % 2 == 1;
        const Counts before = counts(runtime);
        for (const Stopwatch watch; watch.ms() < 250;) {
            if (!editing) {
                std::this_thread::sleep_for(std::chrono::milliseconds(5));
                continue;
            }
            const std::uint64_t from = counts(runtime).cycles;
            const Stopwatch edit;
            runtime.apply(edits[done++ % std::size(edits)]);
            cost.push_back(edit.ms());
            visible.push_back(static_cast<double>(counts(runtime).cycles - from));
        }
        (editing ? missed_edited : missed_idle)
            .push_back(static_cast<double>(counts(runtime).missed - before.missed));
    }
    const auto sum = [](const std::vector<double>& v) {
        double total = 0;
        for (const double x : v) {
            total += x;
        }
        return total;
    };
    report.row({.what = fmt::format("1000 functions at 1 kHz, {} edits: missed periods", done),
                .unit = "",
                .ours = sum(missed_edited),
                .peer = "no edits, as long:",
                .theirs = sum(missed_idle),
                .goal = at_most(1)});
    report.row({.what = "an edit (net delsig delf addf setp): cycles until it is there, p50",
                .unit = "",
                .ours = median(visible),
                .goal = limit(2)});
    report.row(
        {.what = "the same, p99", .unit = "", .ours = quantile(visible, 0.99), .goal = limit(2)});
    report.row(
        {.what = "the same, time of the whole edit, p50", .unit = "ms", .ours = median(cost)});
}

void churn(const Options& options, Report& report) {
    const long wanted = options.full ? 1'000'000 : options.quick ? 10'000 : 100'000;
    Runtime runtime;
    runtime.apply(new_thread("t", 100'000, options.cpu) + gates(50));
    runtime.session.threads().start();
    const Counts idle = counts(runtime);
    std::this_thread::sleep_for(std::chrono::seconds(2));
    const Counts before = counts(runtime);
    const Stopwatch watch;
    long done = 0;
    for (; done < wanted && runtime.session.reports().fault_count() == 0; done += 2) {
        runtime.apply(fmt::format("delf and2.{} t\n", done / 2 % 50));
        runtime.apply(fmt::format("addf and2.{} t 25\n", done / 2 % 50));
    }
    const double seconds = watch.ms() / 1000;
    const Counts after = counts(runtime);
    report.row({.what = fmt::format("{} delf/addf on a running 100 us thread: faults", done),
                .unit = "",
                .ours = static_cast<double>(runtime.session.reports().fault_count()),
                .goal = limit(0)});
    const auto missed = [](const Counts& from, const Counts& to) {
        return 100.0 * static_cast<double>(to.missed - from.missed) /
               static_cast<double>(to.cycles - from.cycles);
    };
    report.row({.what = "the same: periods missed meanwhile",
                .unit = "%",
                .ours = missed(before, after),
                .peer = "no edits, 2 s:",
                .theirs = missed(idle, before)});
    report.note(
        fmt::format("{:.0f} edits per second over {:.0f} s. LinuxCNC 2.9 and 2.10 under the same "
                    "edits, in an earlier measurement: the",
                    static_cast<double>(done) / seconds, seconds));
    report.note(
        "real-time process died by SIGSEGV within 1.4 s in 12 of 12 trials. It is not repeated "
        "here.");
}

}  // namespace

void edit(const Options& options, Report& report) {
    report.section("edit: a machine that runs is rewired");
    live(options, report);
    churn(options, report);
}

}  // namespace hal::bench
