// SPDX-License-Identifier: MIT
// Does a slow thread see one state of a fast one from its first function to its last? The same
// netlist in both runtimes: a fast thread counts in two places, the slow thread copies both with
// its first two functions and with its last two, and a sampler records the copies.
#include <fmt/core.h>
#include <sstream>
#include <thread>

#include "bench.hpp"
#include "linuxcnc.hpp"
#include "machine.hpp"
#include "runtime.hpp"
#include "sample.hpp"

namespace hal::bench {
namespace {

constexpr int between = 500;  // functions

std::string netlist() {
    std::string text = fmt::format(
        "loadrt sum2 names=a,b,first-a,first-b,last-a,last-b\nloadrt not count={}\nloadrt sampler "
        "depth=20000 cfg=ffff\n"
        "net a a.out => a.in1 first-a.in0 last-a.in0\nnet b b.out => b.in1 first-b.in0 last-b.in0\n"
        "setp a.in0 1\nsetp b.in0 1\n"
        "net s0 first-a.out => sampler.0.pin.0\nnet s1 first-b.out => sampler.0.pin.1\n"
        "net s2 last-a.out => sampler.0.pin.2\nnet s3 last-b.out => sampler.0.pin.3\n"
        "addf a fast\naddf b fast\naddf first-a slow\naddf first-b slow\n",
        between);
    for (int i = 0; i < between; ++i) {
        text += fmt::format("addf not.{} slow\n", i);
    }
    return text + "addf last-a slow\naddf last-b slow\naddf sampler.0 slow\n";
}

struct Seen {
    std::uint64_t cycles = 0;
    std::uint64_t unequal = 0;
    void add(double first_a, double first_b, double last_a, double last_b) {
        ++cycles;
        if (first_a != first_b || first_a != last_a || first_a != last_b) {
            ++unequal;
        }
    }
    double percent() const {
        return cycles ? 100.0 * static_cast<double>(unequal) / static_cast<double>(cycles) : 0.0;
    }
};

Seen ours(const Options& options, double seconds) {
    Runtime runtime;
    runtime.apply(new_thread("fast", 50'000, options.cpu, "spin=0") +
                  fmt::format("newthread slow 1000000 cpu={} priority={} spin=0\n", options.cpu,
                              priority - 1) +
                  netlist());
    hal_stream& stream = *runtime.session.host().find_stream("sampler.0");
    runtime.session.threads().start();
    std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
    runtime.session.threads().stop();
    Seen seen;
    for (std::uint64_t at = 0, head = __atomic_load_n(&stream.head, __ATOMIC_ACQUIRE); at < head;
         ++at) {
        const hal_value* const record = stream.data + at % stream.depth * (stream.columns + 1);
        seen.add(record[0].real, record[1].real, record[2].real, record[3].real);
    }
    return seen;
}

std::optional<Seen> linuxcnc(double seconds) {
    const auto peer = LinuxCnc::start("name1=fast period1=50000 name2=slow period2=1000000");
    if (!peer || peer->file(netlist() + "start\n").status != 0) return std::nullopt;
    std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
    peer->command({"stop"});
    Child sampler(peer->program({"halsampler"}), true);
    Seen seen;
    while (const auto line = sampler.line(300)) {
        double v[4];
        std::istringstream words(*line);
        if (words >> v[0] >> v[1] >> v[2] >> v[3]) {
            seen.add(v[0], v[1], v[2], v[3]);
        }
    }
    return seen;
}

}  // namespace

void coherence(const Options& options, Report& report) {
    report.section(
        "coherence: a 1 ms thread of 505 functions reads what a 50 us thread writes on the same "
        "CPU");
    const double seconds = options.quick ? 1.0 : 4.0;
    wait_for_quiet(0.5);
    const Seen own = ours(options, seconds);
    const auto peer = linuxcnc(seconds);
    const bool seen = peer && peer->cycles != 0;
    report.row({.what = fmt::format("first and last function disagree, % of {} cycles", own.cycles),
                .unit = "%",
                .ours = own.percent(),
                .peer = seen ? LinuxCnc::name() : LinuxCnc::absent(),
                .theirs = seen ? std::optional(peer->percent()) : std::nullopt,
                .goal = limit(0)});
    if (seen) {
        report.note(fmt::format("LinuxCNC: {} of {} cycles.", peer->unequal, peer->cycles));
    }
}

}  // namespace hal::bench
