// SPDX-License-Identifier: MIT
// The EtherCAT master on a veth pair, with 50 drives as other masters were measured: 11 bytes out
// and 11 in for each drive, one frame of 1150 bytes of process data and the time of the reference
// clock. The floor is a program that sends the same frame with a plain socket.
#include "ethercat.hpp"

#include <algorithm>
#include <cstdlib>
#include <fmt/core.h>
#include <stdexcept>

#include "drivers/link/ethernet.hpp"
#include "ethercat/config/config.hpp"
#include "ethercat/master/coe_client.hpp"
#include "ethercat/master/master.hpp"
#include "ethercat/wire/frames.hpp"
#include "ethercat_soem.hpp"
#include "ethercat_wire.hpp"
#include "machine.hpp"
#include "process.hpp"
#include "runtime.hpp"
#include "sample.hpp"
#include "segment.hpp"

namespace hal::bench {
namespace {

using namespace hal::ethercat;
constexpr std::int64_t period_ns = 1'000'000;

/// Returns `count` devices of a kind, as a line description.
std::string line_of(int count, const std::string& device) {
    std::string text;
    for (int i = 0; i < count; ++i) {
        text += device + "\n";
    }
    return text;
}

std::string configuration(int count, const std::string& link, const std::string& cycle,
                          const std::string& more = "") {
    std::string text = "[bus]\nlink = " + link + "\ncycle = " + cycle + "\n" + more +
                       "[type drive]\ndevice = cia402\nvendor = 0xFFFFFF\noutputs = 6040 6060 607A "
                       "60FF\ninputs = 6041 6061 6064 606C\ndc = sync0\n";
    for (int i = 0; i < count; ++i) {
        text += fmt::format("[slave {} d{}]\ntype = drive\n", i, i);
    }
    return text;
}

struct NoEvents final : master::Events {
    void on_event(master::Event, std::uint32_t, std::int64_t, std::int64_t) noexcept override {}
};

/// A master as the component makes it, in the hands of one thread.
class OurMaster {
public:
    OurMaster(const std::string& interface, int drives) {
        const config::ReadResult reading =
            config::read(configuration(drives, "eth:" + interface, "1ms"), "bench.ethercat");
        if (!reading.good()) throw std::runtime_error(config::to_string(reading, "bench.ethercat"));
        ethernet::Options options;
        options.types = {ethertype};
        options.policy = ethernet::Policy::block;
        auto opened = ethernet::open("eth:" + interface, options);
        if (!opened) throw std::runtime_error(opened.problem);
        port_ = std::move(opened.port);
        const auto& setup = reading.buses.front().setup;
        mailboxes_ = std::make_unique<master::Mailboxes>(setup.slaves.size() + 64);
        client_ = std::make_unique<master::CoeClient>(*mailboxes_);
        master_ = std::make_unique<master::Master>(setup, port_->address(), events_, *client_);
        master_->attach(*port_);
    }
    /// Cycles of 1 ms until all slaves are operational. Returns the time it took in ms, 0: not
    /// within 20 s.
    double bring_up() {
        const std::int64_t began = link::monotonic_ns();
        for (std::int64_t due = began; due < began + 20'000 * period_ns; due += period_ns) {
            if (due > link::monotonic_ns()) {
                sleep_until(due);
            }
            now_ = due;
            master_->receive(now_);
            if (master_->status().operational) {
                return static_cast<double>(link::monotonic_ns() - began) / 1e6;
            }
            master_->transmit(now_);
        }
        return 0;
    }
    /// More cycles of 1 ms, for the responder to remember what a settled bus answers.
    void settle(int cycles) {
        for (; cycles-- > 0; master_->transmit(now_)) {
            sleep_until(now_ += period_ns);
            master_->receive(now_);
        }
        sleep_until(now_ + period_ns);
        master_->receive(now_ += period_ns);
    }
    /// One cycle: process data out, the answer in. Time passes for the master as in a cycle of 1
    /// ms.
    bool exchange() {
        master_->transmit(now_);
        const bool came = port_->wait(link::monotonic_ns() + 20 * period_ns);
        master_->receive(now_ += period_ns);
        return came;
    }
    const master::Master& master() const { return *master_; }

private:
    NoEvents events_;
    std::unique_ptr<ethernet::Port> port_;
    std::unique_ptr<master::Mailboxes> mailboxes_;
    std::unique_ptr<master::CoeClient> client_;
    std::unique_ptr<master::Master> master_;
    std::int64_t now_ = 0;
};

struct Times {
    std::vector<double> wall, cpu;  // us
    int missed = 0;
};

double thread_cpu_us() {
    timespec t;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) * 1e6 + static_cast<double>(t.tv_nsec) * 1e-3;
}

/// An exchange, and what was measured of it.
template <class Exchange>
struct Measured {
    Times& times;
    Exchange exchange;

    void once() {
        const double cpu = thread_cpu_us();
        const std::int64_t began = link::monotonic_ns();
        if (!exchange()) {
            ++times.missed;
        }
        times.wall.push_back(static_cast<double>(link::monotonic_ns() - began) / 1000);
        times.cpu.push_back(thread_cpu_us() - cpu);
    }
};

/// Measures two kinds of exchange in turn, so that both meet the same noise: back to back in blocks,
/// or one in each millisecond.
template <class One, class Other>
void measure_in_turn(int count, bool paced, Measured<One> one, Measured<Other> other) {
    const int block = paced ? 1 : 100;
    std::int64_t due = link::monotonic_ns() + period_ns;
    const auto run = [&](auto& measured) {
        for (int n = 0; n < block; ++n, due += period_ns) {
            if (paced) {
                sleep_until(due);
            }
            measured.once();
        }
    };
    for (int done = 0; done < count; done += block) {
        run(one);
        run(other);
    }
}

/// Two veth pairs: programs that are measured in turn must not receive each other's frames.
struct Wire {
    const char* here;
    const char* there;
};
constexpr Wire wires[] = {{"bench0", "bench1"}, {"bench2", "bench3"}};

/// Cycle times beside the floor, with a responder for each that blocks on the same CPU, and the
/// start of the bus.
void cycles(const Options& options, Report& report) {
    constexpr int drives = 50;
    const std::string here = wires[0].here, there = wires[0].there;
    Slaves slaves(there, line_of(drives, "servo")), beside(wires[1].there, "");
    const int last = options.cpu, other = last > 0 ? last - 1 : last,
              rounds = options.quick ? 2 : 5;
    std::vector<double> starts;
    Times ours[2], floor[2];
    master::DomainStatus domain;
    std::size_t frame_bytes = 0;
    for (int round = 0; round < rounds; ++round) {
        slaves.start(Slaves::Mode::emulated, other);
        run_real_time(last, [&] {
            OurMaster master(here, drives);
            if (const double ms = master.bring_up(); ms > 0) {
                starts.push_back(ms);
            } else {
                return;
            }
            master.settle(1500);
            slaves.start(Slaves::Mode::null, last);
            beside.learn(slaves);
            beside.start(Slaves::Mode::null, last);
            RawSocket raw(wires[1].here);
            const std::vector<std::uint8_t> frame = slaves.cyclic_frame();
            frame_bytes = frame.size();
            std::array<std::uint8_t, max_frame_bytes> answer;
            const auto plain = [&] {
                raw.send(frame);
                return raw.receive(answer) != 0;
            };
            const auto exchange = [&] { return master.exchange(); };
            for (const bool paced : {false, true}) {
                const int count = paced ? (options.quick ? 500 : 3000) : 5000;
                measure_in_turn(count, paced, Measured{ours[paced], exchange},
                                Measured{floor[paced], plain});
            }
            domain = master.master().domain(0);
        });
        beside.stop();
        slaves.stop();
        if (round + 1 < rounds) {
            for (std::size_t n = 0; n < slaves.line().size(); ++n) {
                slaves.line().set_power(n, false, link::monotonic_ns());
                slaves.line().set_power(n, true, link::monotonic_ns());
            }
        }
    }
    if (starts.empty()) return report.note("the 50 drives did not become operational within 20 s");
    const char* const raw = "send and recv of the same frame";
    const auto share = [](std::vector<double>& samples, double at) {
        return std::optional(quantile(samples, at));
    };
    const Soem peer = soem(options, here, there, line_of(drives, "servo"));
    const std::string by = peer.wall ? "SOEM by pysoem" : "SOEM: " + peer.why;
    report.row({"50 drives, cycle back to back, p50", "us", share(ours[0].wall, 0.5), raw,
                share(floor[0].wall, 0.5), at_most(1.15)});
    report.row({"  CPU, p50", "us", share(ours[0].cpu, 0.5), raw, share(floor[0].cpu, 0.5),
                at_most(1.25)});
    report.row(
        {"  p99", "us", share(ours[0].wall, 0.99), raw, share(floor[0].wall, 0.99), at_most(1.3)});
    report.row(
        {"  back to back beside SOEM, p50", "us", share(ours[0].wall, 0.5), by, peer.wall, {}});
    report.row({"  CPU beside SOEM, p50", "us", share(ours[0].cpu, 0.5), by, peer.cpu, {}});
    report.row({"50 drives, a cycle in each millisecond, p50", "us", share(ours[1].wall, 0.5), raw,
                share(floor[1].wall, 0.5), at_most(1.15)});
    report.row(
        {"  p99", "us", share(ours[1].wall, 0.99), raw, share(floor[1].wall, 0.99), at_most(1.2)});
    report.row({"  beside SOEM, p50", "us", share(ours[1].wall, 0.5), by, peer.paced, {}});
    report.row({"50 drives, scan to OP with mapping and clocks", "ms", median(starts), by,
                peer.start_ms, at_most(0.6)});
    report.note(
        fmt::format("frame of {} bytes; {} exchanges, {} incomplete, {} without an answer in time; "
                    "{} rounds, SCHED_FIFO {}, the responder has "
                    "the same CPU and a higher priority",
                    frame_bytes, domain.exchanges, domain.incomplete,
                    ours[0].missed + ours[1].missed, rounds, priority));
}

/// How far the thread of the runtime is from the grid of the reference clock, which runs 100 ppm
/// fast.
void reference_clock(const Options& options, Report& report, const std::string& here,
                     const std::string& there) {
    constexpr int drives = 5;
    const int last = options.cpu, other = last > 0 ? last - 1 : last;
    Slaves slaves(there, line_of(drives, "servo"));
    slaves.line().controller(0).set_drift(100, link::monotonic_ns());
    slaves.start(Slaves::Mode::emulated, other);
    const TemporaryFolder folder;
    const std::string file =
        folder.file("bench.ethercat", configuration(drives, "eth:" + here, "1ms"));
    Runtime runtime;
    runtime.apply(new_thread("servo", period_ns, last) + "loadrt ethercat config=" + file +
                  "\naddf ethercat.0.receive servo\naddf ethercat.0.transmit servo\n");
    runtime.session.threads().start();
    const auto value = [&](const char* name) {
        return runtime.session.values().read({name}).at(0).value().value;
    };
    const std::int64_t began = link::monotonic_ns();
    while (!value("ethercat.0.all-op").bit && link::monotonic_ns() < began + 20'000 * period_ns) {
        sleep_until(link::monotonic_ns() + 10 * period_ns);
    }
    if (!value("ethercat.0.all-op").bit) {
        return report.note("the 5 drives did not become operational within 20 s");
    }
    sleep_until(link::monotonic_ns() + 3000 * period_ns);
    const auto before = runtime.session.reports().threads()[0];
    const std::uint64_t incomplete = value("ethercat.0.cycles-incomplete").u64;
    std::vector<double> phases;
    for (int n = 0; n < (options.quick ? 2000 : 10'000); ++n) {
        sleep_until(link::monotonic_ns() + period_ns);
        phases.push_back(static_cast<double>(value("ethercat.0.pll-err").s32) / 1000);
    }
    const auto after = runtime.session.reports().threads()[0];
    report.row({.what = "phase of the thread to a reference clock 100 ppm fast, trimmed rms",
                .unit = "us",
                .ours = trimmed_rms(phases),
                .goal = limit(1)});
    report.note(
        fmt::format("{} cycles, {} missed, {} in which a drive got no data before its SYNC0",
                    after.cycles - before.cycles, after.missed - before.missed,
                    value("ethercat.0.cycles-incomplete").u64 - incomplete));
}

/// `hal ethercat slaves` on a line of 30 slaves: identity, state and ports of each.
void scan_by_tool(const Options& options, Report& report, const std::string& here,
                  const std::string& there) {
    constexpr int slaves_count = 30;
    const int last = options.cpu, other = last > 0 ? last - 1 : last;
    Slaves slaves(there, line_of(slaves_count, "servo"));
    slaves.start(Slaves::Mode::emulated, other);
    std::vector<double> times;
    for (int n = 0; n < (options.quick ? 3 : 9); ++n) {
        const Finished scan =
            run({{options.programs + "/hal", "ethercat", "scan", "eth:" + here}}, 60'000);
        if (scan.status != 0) return report.note("30 slaves were not scanned by hal ethercat scan");
        times.push_back(scan.ms);
    }
    report.row({.what = "30 slaves scanned by hal ethercat scan",
                .unit = "ms",
                .ours = median(times),
                .goal = limit(300)});
}

/// Makes a veth pair.
bool lay(const Wire& wire) {
    const std::string command = fmt::format(
        "ip link add {0} type veth peer name {1} 2>/dev/null && ip link set {0} up && ip link set "
        "{1} up",
        wire.here, wire.there);
    return std::system(command.c_str()) == 0;
}

void on_veth(const Options& options, Report& report) {
    if (!std::all_of(std::begin(wires), std::end(wires), lay)) {
        return report.note("no veth pair can be made here (`ip` of iproute2)");
    }
    cycles(options, report);
    reference_clock(options, report, wires[0].here, wires[0].there);
    scan_by_tool(options, report, wires[0].here, wires[0].there);
}

}  // namespace

void ethercat(const Options& options, Report& report) {
    report.section("EtherCAT");
    if (!in_own_network([&] { on_veth(options, report); })) {
        report.note("no network namespace may be made here: run as root");
    }
    ethercat_machines(options, report);
}

}  // namespace hal::bench
