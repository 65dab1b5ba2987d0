// SPDX-License-Identifier: MIT
// What a function costs in a thread of many: the runtime with its statistics, a hand-written loop
// over the same structs, and LinuxCNC, each with everything in the caches ("hot") and once a
// millisecond.
#include <algorithm>
#include <array>
#include <fmt/core.h>
#include <limits>
#include <thread>

#include "bench.hpp"
#include "dispatch_loops.hpp"
#include "execute/core.hpp"
#include "linuxcnc.hpp"
#include "machine.hpp"
#include "model/compile.hpp"
#include "runtime.hpp"
#include "sample.hpp"

namespace hal::bench {
namespace {

/// A case named so has these in turn, so that no function follows one like it.
constexpr const char* mixed = "mixed";
constexpr std::array kinds{"and2", "sum2", "mux2", "limit1"};

struct Case {
    const char* component;
    std::size_t count;
    std::size_t linuxcnc_count;  // what its shared memory holds; pid: its own limit
    const char* function = "";   // below the instance's name
    bool chained = false;        // each out is linked to the next in0
};

constexpr Case cases[] = {
    {"and2", 1000, 900},
    {"sum2", 1000, 900},
    {"mux2", 1000, 900},
    {"limit1", 1000, 900},
    {"pid", 100, 16, ".do-pid-calcs"},
    {"and2", 1000, 800, "", true},
    {"sum2", 1000, 800, "", true},
    {mixed, 1000, 800},
};

/// Instances, links, values; then the functions in a thread `t`.
std::string netlist(const Case& c, std::size_t count) {
    if (c.component == mixed) {
        std::string text;
        for (const char* kind : kinds) {
            text += fmt::format("loadrt {} count={}\n", kind, count / kinds.size());
        }
        for (std::size_t i = 0; i < count; ++i) {
            text += fmt::format("addf {}.{} t\n", kinds[i % kinds.size()], i / kinds.size());
        }
        return text;
    }
    const bool pid = std::string_view(c.component) == "pid";
    std::string text =
        fmt::format("loadrt {} {}={}\n", c.component, pid ? "num_chan" : "count", count);
    for (std::size_t i = 0; c.chained && i + 1 < count; ++i) {
        text +=
            fmt::format("net c{} {}.{}.out => {}.{}.in0\n", i, c.component, i, c.component, i + 1);
    }
    for (std::size_t i = 0; pid && i < count; ++i) {
        text += fmt::format(
            "setp pid.{0}.enable 1\nsetp pid.{0}.Pgain 2\nsetp pid.{0}.Igain 0.5\nsetp "
            "pid.{0}.Dgain 0.01\nsetp pid.{0}.command {0}\n",
            i);
    }
    for (std::size_t i = 0; i < count; ++i) {
        text += fmt::format("addf {}.{}{} t\n", c.component, i, c.function);
    }
    return text;
}

/// The machine of a case, loaded but not running, with a plan to run.
class Bed {
public:
    explicit Bed(const Case& c) : runtime_(true), loop_(loop_over(c.component)) {
        runtime_.apply("newthread t 1000000\n" + netlist(c, c.count));
        const Model& model = runtime_.session.model();
        for (const LoadedFunction* function : model.threads.front()->functions) {
            instances_.push_back(function->instances.front()->memory);
        }
    }

    /// A core on this machine that measures itself, or not.
    std::unique_ptr<Core> core(bool measure) {
        const Model& model = runtime_.session.model();
        Thread& t = *model.threads.front();
        const ThreadPins pins{&t.time, &t.tmax, &t.tmax_increased, &t.beat, &t.missed, &t.wakeup};
        auto core = std::make_unique<Core>(1U, t.options.period_ns, pins, board_, timeline_,
                                           running_, measure);
        if (!plan_) {
            compile_for(*core);
        }
        core->offer(plan_.get());
        core->service();
        return core;
    }
    void loop(std::uint64_t cycle) const {
        const hal_cycle info{sizeof info, 0, 1'000'000, 1e-3, 0, cycle};
        loop_(instances_.data(), instances_.size(), &info);
    }
    /// The plan's calls and nothing else: no record of the running function, no end when its thread
    /// is declared hung, no clock.
    void calls(std::uint64_t cycle) const {
        const hal_cycle info{sizeof info, 0, 1'000'000, 1e-3, 0, cycle};
        const plan::Step* step = plan_->steps.data();
        const plan::Step* const end = step + plan_->steps.size();
        for (; end - step >= 8; step += 8) {
            step[0].step(step[0].self, &info);
            step[1].step(step[1].self, &info);

            step[2].step(step[2].self, &info);
            step[3].step(step[3].self, &info);
            step[4].step(step[4].self, &info);
            step[5].step(step[5].self, &info);

            step[6].step(step[6].self, &info);
            step[7].step(step[7].self, &info);
        }
        for (; step != end; ++step) {
            step->step(step->self, &info);
        }
    }
    std::size_t count() const { return instances_.size(); }

private:
    void compile_for(Core& core) {
        CompileInput input;
        input.epoch = 1'000'000;
        const std::unordered_set<const LoadedFunction*> none;
        const Notes<Pin, hal_value> pins;
        const Notes<Signal, hal_value> signals;
        const Notes<Signal, Pin*> inherited;
        const std::unordered_map<const Pin*, hal_pin*> replaced;
        input.without = &none;
        input.pin_values = &pins;
        input.signal_values = &signals;
        input.inherited = &inherited;
        input.old_memory = &replaced;
        input.core_of = [&](const Thread&) -> void* { return &core; };
        input.check_finite = check_finite;
        plan_ = std::move(compile(runtime_.session.model(), input).plans.front().second);
    }

    // One for all cores, so that they work on the same memory; before the session, which writes
    // through the pins at its end.
    std::unique_ptr<plan::Plan> plan_;
    Runtime runtime_;
    Loop loop_;
    std::vector<void*> instances_;
    FaultBoard board_;
    Timeline timeline_;
    std::atomic<bool> running_{true};
};

struct Hot {
    double ours = 0;
    double loop = 0;
    double bare = 0;
    double calls = 0;  // ns per function; bare: without statistics
};

/// Cycles back to back in a real-time thread, the four in turn; medians of single cycles.
Hot measure_hot(const Options& options, const Case& c) {
    Bed bed(c);
    const auto measured = bed.core(true);
    const auto bare = bed.core(false);
    std::vector<double> ours, loop, without, calls;
    const int rounds = options.quick ? 4 : 10;
    const int cycles = options.quick ? 500 : 2000;
    const auto time = [&](std::vector<double>& samples, auto cycle) {
        for (int i = 0; i < cycles; ++i) {
            const std::int64_t begin = monotonic_ns();
            cycle(begin, static_cast<std::uint64_t>(i));
            if (const std::int64_t end = monotonic_ns(); i >= 10) {
                samples.push_back(static_cast<double>(end - begin));
            }
        }
    };
    for (int round = 0; round < rounds; ++round) {
        run_real_time(options.cpu, [&] {
            time(ours, [&](std::int64_t now, std::uint64_t) { measured->cycle(now, now, now); });
            time(loop, [&](std::int64_t, std::uint64_t i) { bed.loop(i); });
            time(without, [&](std::int64_t now, std::uint64_t) { bare->cycle(now, now, now); });
            time(calls, [&](std::int64_t, std::uint64_t i) { bed.calls(i); });
        });
    }
    const auto per = [&](std::vector<double>& samples) {
        return median(samples) / static_cast<double>(bed.count());
    };
    return {per(ours), per(loop), per(without), per(calls)};
}

/// Values of a time that changes each millisecond, read beside it.
template <class Read>
std::vector<double> watch(std::size_t count, Read read) {
    std::vector<double> samples;
    while (samples.size() < count) {
        std::this_thread::sleep_for(std::chrono::microseconds(1200));
        samples.push_back(read());
    }
    return samples;
}

/// The best of many rounds.
double clock_ns() {
    double best = std::numeric_limits<double>::max();
    for (int round = 0; round < 200; ++round) {
        const std::int64_t begin = monotonic_ns();
        for (int i = 1; i < 100; ++i) {
            monotonic_ns();
        }
        best = std::min(best, static_cast<double>(monotonic_ns() - begin) / 100);
    }
    return best;
}

struct Slow {
    double ours = 0;
    double loop = 0;
    double cold = 0;  // cold: spin=0, so nothing is fetched before the deadline
};

/// Once a millisecond, in turn; medians of what a sampler sees of the time of the whole thread, as
/// with LinuxCNC.
Slow measure_at_rate(const Options& options, const Case& c) {
    std::vector<double> ours, loop, cold;
    const std::size_t samples = options.quick ? 150 : 300;
    const auto settle = [] { std::this_thread::sleep_for(std::chrono::milliseconds(25)); };
    const auto rate = [&](const char* how) {
        Runtime runtime;
        runtime.apply(new_thread("t", 1'000'000, options.cpu, how) + netlist(c, c.count));
        runtime.session.threads().start();
        const Thread& t = *runtime.session.model().threads.front();
        settle();
        std::vector<double> seen = watch(samples, [&] {
            return static_cast<double>(__atomic_load_n(&t.time.slot->s32, __ATOMIC_RELAXED));
        });
        return median(seen);
    };
    for (int round = 0; round < (options.quick ? 1 : 2); ++round) {
        ours.push_back(rate(""));
        Bed bed(c);
        const auto bind = bed.core(false);
        {
            PeriodicThread thread(options.cpu, 1'000'000,
                                  [&](std::uint64_t cycle) { bed.loop(cycle); });
            settle();
            std::vector<double> seen =
                watch(samples, [&] { return static_cast<double>(thread.last_ns()); });
            loop.push_back(median(seen));
        }
        if (round == 0) {
            cold.push_back(rate("spin=0"));
        }
    }
    const auto n = static_cast<double>(c.count);
    return {median(ours) / n, median(loop) / n, median(cold) / n};
}

struct Peer {
    std::optional<double> hot, slow;
};

/// LinuxCNC by the same sampling; its smallest sample stands for hot.
Peer measure_linuxcnc(const Options& options, const Case& c) {
    const auto peer = LinuxCnc::start("name1=t period1=1000000");
    if (!peer || peer->file(netlist(c, c.linuxcnc_count) + "start\n").status != 0) {
        return {};
    }
    peer->sample("t.time", 20, 1200);
    std::vector<double> samples = peer->sample("t.time", options.quick ? 200 : 600, 1200);
    std::erase_if(samples, [](double s) { return s <= 0; });
    if (samples.empty()) {
        return {};
    }
    const double unit = LinuxCnc::ns_per_time_unit() / static_cast<double>(c.linuxcnc_count);
    return {*std::min_element(samples.begin(), samples.end()) * unit, median(samples) * unit};
}

}  // namespace

void dispatch(const Options& options, Report& report) {
    report.section("dispatch: ns per function in a thread of 1000 (pid: 100), statistics on");
    std::vector<std::pair<std::string, Hot>> statistics;
    for (const Case& c : cases) {
        const std::string name = c.component + std::string(c.chained ? ", chained" : "");
        wait_for_quiet(1.0);
        const Hot hot = measure_hot(options, c);
        const Slow slow = measure_at_rate(options, c);
        const Peer peer = measure_linuxcnc(options, c);
        statistics.emplace_back(name, hot);
        const std::string absent =
            LinuxCnc::absent().empty() ? "LinuxCNC did not start" : LinuxCnc::absent();
        const auto peer_name = [&](const std::optional<double>& figure) {
            return figure ? LinuxCnc::name() : absent;
        };
        report.row({name + ", hot", "ns", hot.ours, "loop", hot.loop, at_most(1.5)});
        report.row({"", "ns", hot.ours, peer_name(peer.hot), peer.hot, times_less(3)});
        report.row({name + ", 1 kHz", "ns", slow.ours, "loop", slow.loop, at_most(1.5)});
        report.row({"", "ns", slow.ours, peer_name(peer.slow), peer.slow, times_less(5)});
        report.row({name + ", 1 kHz, spin=0", "ns", slow.cold, "loop", slow.loop});
    }
    const Hot& in_turn = statistics.back().second;
    report.row(
        {std::string(mixed) + ", hot", "ns", in_turn.ours, "its calls alone", in_turn.calls});
    report.row({.what = "one reading of the clock; statistics take three in a cycle",
                .unit = "ns",
                .ours = clock_ns()});
    for (const auto& [name, hot] : statistics) {
        report.row({name + ", cost of statistics, hot", "ns", hot.ours, "without", hot.bare,
                    at_most(1.1)});
    }
    report.note(
        "mixed: and2, sum2, mux2 and limit1 in turn. Functions of one kind in a row are run by one "
        "loop in their plugin.");
    report.note(
        "A thread that spins before its deadline fetches its instances into the caches meanwhile; "
        "with spin=0 it cannot.");
    report.note(
        "Medians. Ours is the whole cycle divided by its functions. LinuxCNC's hot figure is its "
        "best cycle at 1 kHz, of as many");
    report.note("functions as fit its shared memory (900; chained 800; pid 16).");
}

}  // namespace hal::bench
