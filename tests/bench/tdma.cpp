// SPDX-License-Identifier: MIT
// TDMA between real interfaces: how exactly a station whose clock is 200 ppm off meets its slot, by
// the kernel's stamps at the other end, against a bare loop on the observer's own clock; and how
// soon a backup master goes on when the master is gone.
#include "tdma.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <fmt/core.h>
#include <fstream>
#include <linux/if_packet.h>
#include <net/if.h>
#include <optional>
#include <sstream>
#include <sys/socket.h>
#include <thread>

#include "drivers/link/ethernet.hpp"
#include "drivers/link/system.hpp"
#include "fieldbus/tdma/station/station.hpp"
#include "hal/discipline.hpp"
#include "machine.hpp"
#include "process.hpp"
#include "sample.hpp"
#include "segment.hpp"
#include "tools/bus/tdma/skewed_port.hpp"

namespace hal::bench {
namespace {

using tdma::Role;
using tdma::StationSetup;

constexpr double skew = 200e-6;
using Frame = std::array<std::uint8_t, ethernet::smallest_frame>;

Frame data_frame(const ethernet::Address& from) {
    Frame f{};
    std::fill_n(f.begin(), 6, std::uint8_t{0xff});
    std::copy(from.begin(), from.end(), f.begin() + 6);
    f[12] = 0x90;
    f[13] = 0x23;
    return f;
}

/// A station in a thread of its own, with a clock of its own; once it may, it sends a frame in each
/// cycle.
class Participant {
public:
    Participant(const std::string& interface, const StationSetup& setup, int cpu, double ppm,
                bool paced)
        : clock_(link::monotonic_ns(), ppm, 0.0),
          spin_(std::min<std::int64_t>(150'000, setup.cycle * 2 / 5)),
          station_(setup) {
        ethernet::Options how{.types = {tdma::Station::types.begin(), tdma::Station::types.end()},
                              .spin_ns = std::max(spin_, setup.cycle / 3)};
        // Its sync must not wait for the thread, which looks at the clock on the same CPU.
        if (paced) {
            how.pacer = true;
            how.pacer_priority = priority + 1;
            how.pacer_cpu = cpu;

            how.spin_ns = spin_;
        }
        auto opened = ethernet::open("eth:" + interface, how);
        if (!opened) throw std::runtime_error(opened.problem);
        port_ = std::make_unique<tools::SkewedPort>(std::move(opened.port), clock_);
        station_.attach(*port_);
        thread_ = std::thread([this, cpu] { run_real_time(cpu, [this] { run(); }); });
    }
    ~Participant() { end(); }
    /// At once: what its pacer still has does not leave either.
    void end() {
        done_ = true;
        if (thread_.joinable()) {
            thread_.join();
        }
        station_.detach();
        port_.reset();
    }
    bool ready() const { return station_.ready(); }
    const ethernet::Address& address() const { return station_.address(); }

private:
    void run() {
        const Frame frame = data_frame(station_.address());
        const auto cycle = station_.setup().cycle;
        auto due = clock_.local(link::monotonic_ns()) + cycle;
        while (!done_.load(std::memory_order_relaxed)) {
            wait_until(clock_.from_local(due), spin_);
            for (const auto now = clock_.local(link::monotonic_ns()); due < now - cycle / 2;) {
                due += cycle;
            }
            station_.receive(due);
            if (station_.ready() && !station_.setup().slots.empty()) {
                station_.send(frame, tdma::default_slot, 0);
            }
            station_.transmit(due);
            due += cycle;
            if (station_.status().state != tdma::State::listening) {
                due += beat_.follow(station_.error(), cycle);
            }
        }
    }

    const tools::SkewedClock clock_;
    const std::int64_t spin_;
    tdma::Station station_;
    hal::Discipline beat_;
    std::unique_ptr<tools::SkewedPort> port_;
    std::atomic<bool> done_{false};
    std::thread thread_;
};

/// A port that only looks on; everything is stamped by the kernel.
std::unique_ptr<ethernet::Port> observer(const std::string& interface, std::uint16_t type) {
    auto opened = ethernet::open("eth:" + interface, {.types = {type}, .receive_capacity = 16384});
    if (!opened) throw std::runtime_error(opened.problem);
    return std::move(opened.port);
}

template <class Condition>
bool within(double max_s, Condition condition) {
    const auto end = link::monotonic_ns() + static_cast<std::int64_t>(max_s * 1e9);
    while (!condition()) {
        if (link::monotonic_ns() > end) return false;
        sleep_until(link::monotonic_ns() + 10'000'000);
    }
    return true;
}

/// How far arrivals are from a grid of that period, us.
std::vector<double> phases(ethernet::Port& port, std::int64_t cycle, std::size_t count,
                           double max_s) {
    std::vector<double> us;
    while (port.receive(0)) {
    }
    std::int64_t first = 0;
    within(max_s, [&] {
        while (auto arrival = port.receive(0)) {
            if (first == 0) {
                first = arrival->time_ns - cycle / 2;
            }
            us.push_back(static_cast<double>((arrival->time_ns - first) % cycle - cycle / 2) /
                         1000);
        }
        return us.size() >= count;
    });
    return us;
}

/// What a program without TDMA would do: the same frame at the same times, on the same clock as the
/// observer's.
std::vector<double> bare_loop(const std::string& interface, ethernet::Port& port,
                              std::int64_t cycle, int cpu, std::size_t count) {
    const link::Descriptor socket(::socket(AF_PACKET, SOCK_RAW, 0));
    sockaddr_ll place{};
    place.sll_family = AF_PACKET;
    place.sll_ifindex = static_cast<int>(if_nametoindex(interface.c_str()));
    const int one = 1;
    setsockopt(socket.get(), SOL_PACKET, PACKET_QDISC_BYPASS, &one, sizeof one);
    if (::bind(socket.get(), reinterpret_cast<const sockaddr*>(&place), sizeof place) != 0) {
        throw std::runtime_error("no raw socket");
    }
    std::atomic<bool> done{false};
    std::thread sender([&] {
        run_real_time(cpu, [&] {
            const Frame frame = data_frame({2, 0, 0, 0, 0, 1});
            const auto spin = std::min<std::int64_t>(150'000, cycle * 2 / 5);
            for (auto due = link::monotonic_ns() + cycle; !done.load(std::memory_order_relaxed);
                 due += cycle) {
                wait_until(due, spin);
                (void)!::send(socket.get(), frame.data(), frame.size(), 0);
                while (due + cycle < link::monotonic_ns()) {
                    due += cycle;
                }
            }
        });
    });
    std::vector<double> us = phases(port, cycle, count, 20);
    done = true;
    sender.join();
    return us;
}

void jitter(const std::vector<std::string>& lines, std::int64_t cycle, const Options& options,
            Report& report) {
    const int last = options.cpu, other = last > 0 ? last - 1 : last,
              rounds = options.quick ? 1 : 3;
    const auto count = static_cast<std::size_t>((options.quick ? 1'000'000'000 : 3'000'000'000) /
                                                std::max<std::int64_t>(cycle, 300'000));
    std::vector<double> ours, theirs;
    std::size_t missed = 0;
    std::size_t expected = 0;
    for (int round = 0; round < rounds; ++round) {
        StationSetup master{
            .role = Role::master, .cycle = cycle, .phase = cycle * 3 / 10, .guard = cycle / 10};
        StationSetup slave{
            .role = Role::slave, .cycle = cycle, .phase = cycle * 3 / 10, .guard = cycle / 10};
        slave.slots.push_back({.id = tdma::default_slot, .offset = cycle * 6 / 10});
        const auto looking = observer(lines[0], 0x9023);
        {
            Participant first(lines[0], master, last, 0.0, true),
                second(lines[1], slave, other, skew, false);
            if (!within(15, [&] { return second.ready(); })) {
                return report.note(fmt::format(
                    "cycle of {} us: the station did not come so far as to send", cycle / 1000));
            }
            // until the clock's drift is known
            sleep_until(link::monotonic_ns() + std::max<std::int64_t>(300'000'000, 1000 * cycle));
            const auto began = link::monotonic_ns();
            std::vector<double> us = phases(*looking, cycle, count, 20);
            expected += static_cast<std::size_t>((link::monotonic_ns() - began) / cycle);

            missed += us.size();
            if (us.size() > 100) {
                ours.push_back(trimmed_rms(us));
            }
        }
        std::vector<double> us = bare_loop(lines[1], *looking, cycle, other, count);
        if (us.size() > 100) {
            theirs.push_back(trimmed_rms(us));
        }
    }
    const auto best = [](std::vector<double>& v) {
        return v.empty() ? std::nullopt : std::optional(median(v));
    };
    report.row(
        {fmt::format("slot jitter at {} us, clock 200 ppm off, 1 %-trimmed rms", cycle / 1000),
         "us", best(ours), "bare loop, same clock", best(theirs), limit(1.4, 1.1)});
    report.row({.what = "  cycles with a frame",
                .unit = "%",
                .ours = 100.0 * static_cast<double>(std::min(missed, expected)) /
                        static_cast<double>(std::max<std::size_t>(expected, 1))});
}

/// The master is taken away in the middle: how many cycles from its last sync to the backup's
/// first, and how long after it was due.
void loss(const std::vector<std::string>& lines, const Options& options, Report& report) {
    constexpr std::int64_t cycle = 1'000'000;
    constexpr std::int64_t offset = 200'000;
    const int last = options.cpu, other = last > 0 ? last - 1 : last,
              rounds = options.quick ? 2 : 5;
    double worst = 0;
    double worst_late = 0;
    int seen = 0;
    for (int round = 0; round < rounds; ++round) {
        StationSetup clock{
            .role = Role::master, .cycle = cycle, .phase = 300'000, .guard = 100'000};
        StationSetup backup{.role = Role::backup,
                            .cycle = cycle,
                            .backup_offset = offset,
                            .phase = 100'000,
                            .guard = 100'000};
        backup.slots.push_back({.id = tdma::default_slot, .offset = 400'000});
        const auto looking = observer(lines[2], tdma::rtmac_type);
        Participant first(lines[0], clock, last, 0.0, true),
            second(lines[1], backup, other, skew, false);
        if (!within(15, [&] { return second.ready(); })) continue;
        sleep_until(link::monotonic_ns() + 200'000'000);
        const auto from = first.address();
        while (looking->receive(0)) {
        }
        sleep_until(link::monotonic_ns() + 20'000'000);
        first.end();
        sleep_until(link::monotonic_ns() + 50'000'000);
        std::optional<std::uint32_t> before;
        std::int64_t at = 0;
        bool found = false;
        while (const auto arrival = looking->receive(0)) {
            const auto d = tdma::decode(arrival->bytes);
            if (d.kind != tdma::Kind::sync || found) continue;
            if (d.from == from) {
                before = d.sync.cycle;
                at = arrival->time_ns;
            } else if (before) {
                worst = std::max(worst, static_cast<double>(d.sync.cycle - *before));
                worst_late =
                    std::max(worst_late, static_cast<double>(arrival->time_ns - at - cycle) / 1000);
                found = true;
                ++seen;
            }
        }
    }
    if (seen == 0) return report.note("the backup master was not seen to take over");
    report.row({.what = "master gone: cycles from its last sync to the backup's first",
                .unit = "",
                .ours = worst,
                .goal = limit(1)});
    report.row({.what = "  after that sync was due, backup offset 200 us",
                .unit = "us",
                .ours = worst_late});
    report.note(fmt::format("{} of {} times; the worst of them", seen, rounds));
}

/// The test's netlist up to where the cable of the clock breaks; then it does, and an axis has to
/// stay on its path. On the virtual clock.
void axis_meanwhile(const Options& options, Report& report) {
    const std::string folder = HALCYON_SOURCE "/tests/netlists/ethernet_clock_lost/";
    std::ifstream file(folder + "test.hal");
    std::ostringstream all;
    all << file.rdbuf();
    std::string text = all.str();
    const auto cut = text.find("# the clock is cut off");
    if (cut == std::string::npos) return report.note("missing netlist of the test: " + folder);
    text = text.substr(0, cut) +
           "loadrt minmax\nnet error => minmax.0.in\naddf minmax.0 servo\nsetp minmax.0.reset "
           "TRUE\nadvance 2ms\n"
           "setp minmax.0.reset FALSE\nsetp segment-faults.0.cut TRUE\nadvance 2s\ngetp "
           "minmax.0.min\ngetp minmax.0.max\n";
    TemporaryFolder there;
    for (const char* name : {"cell.tdma", "axis.canopen"}) {
        std::ifstream from(folder + name);
        std::ostringstream bytes;
        bytes << from.rdbuf();
        std::string copy = bytes.str();
        if (const auto at = copy.find("../../../"); at != std::string::npos) {
            copy.replace(at, 9, HALCYON_SOURCE "/");
        }
        there.file(name, copy);
    }
    const Finished done = run({{options.programs + "/hal", "sim", there.file("lost.hal", text)}});
    std::istringstream said(done.out);
    std::vector<std::string> words;
    for (std::string line; std::getline(said, line);) {
        words.push_back(line);
    }
    if (done.status != 0 || words.size() < 2) {
        return report.note("the axis beside it was not simulated: hal sim ended with " +
                           std::to_string(done.status));
    }
    const double max = std::max(std::abs(std::atof(words[words.size() - 2].c_str())),
                                std::abs(std::atof(words.back().c_str())));
    report.row({.what = "  largest following error of an axis meanwhile (virtual clock)",
                .unit = "mm",
                .ours = max,
                .goal = limit(1)});
}

void measure(const Options& options, Report& report) {
    const auto lines = make_segment(3);
    if (lines.empty()) {
        return report.note("no bridge and veth pairs can be made here (`ip` of iproute2)");
    }
    jitter(lines, 1'000'000, options, report);
    jitter(lines, 100'000, options, report);
    loss(lines, options, report);
    report.note(
        fmt::format("stations of this process on a bridge, SCHED_FIFO {}; arrivals by the kernel's "
                    "stamps; jitter: median of the rounds",
                    priority));
}

}  // namespace

void time_slots(const Options& options, Report& report) {
    report.section("TDMA on a segment of three stations");
    if (!in_own_network([&] { measure(options, report); })) {
        report.note("no network namespace may be made here: run as root");
    }
    axis_meanwhile(options, report);
}

}  // namespace hal::bench
