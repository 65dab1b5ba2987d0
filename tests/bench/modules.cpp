// SPDX-License-Identifier: MIT
// What a function of a compiled module of LinuxCNC costs here and in LinuxCNC: the same file, the
// same netlist, the same sampling.
#include <algorithm>
#include <chrono>
#include <fmt/core.h>
#include <thread>

#include "bench.hpp"
#include "linuxcnc.hpp"
#include "machine.hpp"
#include "runtime.hpp"
#include "sample.hpp"

namespace hal::bench {
namespace {

struct Case {
    const char* module;
    std::size_t count;
    const char* argument;  // that gives the number of instances
    const char* function;  // below the instance's name
};

constexpr Case cases[] = {{"and2", 800, "count", ""},
                          {"sum2", 800, "count", ""},
                          {"mux2", 800, "count", ""},
                          {"limit1", 800, "count", ""},
                          {"pid", 16, "num_chan", ".do-pid-calcs"}};

/// `load`: the command that loads a module.
std::string netlist(const Case& c, const char* load) {
    std::string text = fmt::format("{} {} {}={}\n", load, c.module, c.argument, c.count);
    for (std::size_t i = 0; i < c.count; ++i) {
        text += fmt::format("addf {}.{}{} t\n", c.module, i, c.function);
    }
    return text;
}
/// A motion controller of five joints at standstill.
std::string motion(const char* load) {
    return fmt::format(
        "{0} trivkins coordinates=xyzac\n{0} tpmod\n{0} homemod\n{0} motmod "
        "servo_period_nsec=1000000 num_joints=5\n"
        "addf motion-command-handler t\naddf motion-controller t\n",
        load);
}

struct Figure {
    double best = 0;
    double median = 0;  // ns of a cycle
};
std::optional<Figure> figure(std::vector<double> samples) {
    std::erase_if(samples, [](double s) { return s <= 0; });
    if (samples.empty()) {
        return {};
    }
    const double best = *std::min_element(samples.begin(), samples.end());
    return Figure{best, median(samples)};
}

std::optional<Figure> ours(const Options& options, const std::string& text) {
    std::vector<double> samples;
    Runtime runtime;
    runtime.apply(new_thread("t", 1'000'000, options.cpu) + text);
    runtime.session.threads().start();
    const Thread& t = *runtime.session.model().threads.front();
    std::this_thread::sleep_for(std::chrono::milliseconds(25));
    for (int i = 0; i < (options.quick ? 200 : 600); ++i) {
        std::this_thread::sleep_for(std::chrono::microseconds(1200));
        samples.push_back(
            static_cast<double>(__atomic_load_n(&t.time.slot->s32, __ATOMIC_RELAXED)));
    }
    return figure(std::move(samples));
}

std::optional<Figure> theirs(const Options& options, const std::string& text) {
    const auto peer = LinuxCnc::start("name1=t period1=1000000");
    if (!peer || peer->file(text + "start\n").status != 0) {
        return {};
    }
    peer->sample("t.time", 20, 1200);
    auto result = figure(peer->sample("t.time", options.quick ? 200 : 600, 1200));
    if (result) {
        result->best *= LinuxCnc::ns_per_time_unit();

        result->median *= LinuxCnc::ns_per_time_unit();
    }
    return result;
}

void compare(const Options& options, Report& report, const std::string& name, std::size_t count,
             const std::string& here, const std::string& there) {
    wait_for_quiet(1.0);
    const auto a = ours(options, here);
    const auto b = theirs(options, there);
    const auto part = [&](const std::optional<Figure>& of, double Figure::* which) {
        return of ? std::optional((*of).*which / static_cast<double>(count)) : std::nullopt;
    };
    report.row({name + ", best cycle", "ns", part(a, &Figure::best), LinuxCnc::name(),
                part(b, &Figure::best), not_above()});
    report.row({name + ", 1 kHz", "ns", part(a, &Figure::median), LinuxCnc::name(),
                part(b, &Figure::median), not_above()});
}

}  // namespace

void modules(const Options& options, Report& report) {
    report.section(
        "modules: ns per function of a compiled module of LinuxCNC, in a thread of 800 (pid: 16)");
    if (!LinuxCnc::absent().empty()) {
        report.note(LinuxCnc::absent());
        return;
    }
    for (const Case& c : cases) {
        compare(options, report, c.module, c.count, netlist(c, "loadrt --linuxcnc"),
                netlist(c, "loadrt"));
    }
    compare(options, report, "motmod, 5 joints, a cycle", 1, motion("loadrt --linuxcnc"),
            motion("loadrt"));
    report.note(
        "The same files and netlists, unmodified; the time of the whole thread, read every 1.2 ms, "
        "divided by its functions.");
}

}  // namespace hal::bench
