// SPDX-License-Identifier: MIT
// Raw Ethernet over a veth pair: round trips and one-way times of our port against the same
// exchange of a plain socket program, in turn in the same minute. Both ends of an exchange are of
// the same kind.
#include "ethernet.hpp"

#include <arpa/inet.h>
#include <atomic>
#include <cstdlib>
#include <cstring>
#include <fmt/core.h>
#include <linux/if_packet.h>
#include <net/if.h>
#include <stdexcept>
#include <sys/socket.h>
#include <thread>

#include "drivers/link/ethernet.hpp"
#include "drivers/link/system.hpp"
#include "machine.hpp"
#include "sample.hpp"
#include "segment.hpp"

namespace hal::bench {
namespace {

constexpr std::uint16_t type = 0x88b5;  // for local experiments (IEEE 802)
constexpr std::int64_t period_ns = 1'000'000;
constexpr std::int64_t spin_ns = 150'000;
using Bytes = std::array<std::uint8_t, ethernet::smallest_frame>;
enum class Wait { spin, block, hybrid };

Bytes broadcast_frame() {
    Bytes f{};
    std::fill_n(f.begin(), 6, std::uint8_t{0xff});
    f[6] = 2;
    f[12] = type >> 8;
    f[13] = type & 0xff;
    return f;
}
void put_time(Bytes& f, std::int64_t time) { std::memcpy(&f[22], &time, sizeof time); }
std::int64_t time_in(const std::uint8_t* f) {
    std::int64_t time = 0;
    std::memcpy(&time, f + 22, sizeof time);
    return time;
}

/// The floor: what a program of its own would write.
class Plain {
public:
    Plain(const std::string& interface, Wait wait, bool stamps)
        : wait_(wait), stamps_(stamps), socket_(::socket(AF_PACKET, SOCK_RAW, htons(type))) {
        sockaddr_ll address{};
        address.sll_family = AF_PACKET;
        address.sll_protocol = htons(type);
        address.sll_ifindex = static_cast<int>(if_nametoindex(interface.c_str()));
        const int one = 1;
        const timeval second{1, 0};
        setsockopt(socket_.get(), SOL_PACKET, PACKET_QDISC_BYPASS, &one, sizeof one);
        setsockopt(socket_.get(), SOL_SOCKET, SO_RCVTIMEO, &second, sizeof second);
        if (stamps) {
            setsockopt(socket_.get(), SOL_SOCKET, SO_TIMESTAMPNS, &one, sizeof one);
        }
        if (::bind(socket_.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) !=
            0) {
            throw std::runtime_error("no raw socket");
        }
    }
    void send(Bytes& f) {
        if (stamps_) {
            put_time(f, link::clock_ns(CLOCK_REALTIME));
        }
        (void)!::send(socket_.get(), f.data(), f.size(), 0);
    }
    /// Whether a frame came by then, and how long it took, by the kernel's stamp.
    bool receive(std::int64_t until, double& one_way_us) {
        if (wait_ == Wait::hybrid && until - spin_ns > link::monotonic_ns()) {
            sleep_until(until - spin_ns);
        }
        std::uint8_t bytes[2048];
        for (;;) {
            if (!stamps_) {
                if (::recv(socket_.get(), bytes, sizeof bytes,
                           wait_ == Wait::block ? 0 : MSG_DONTWAIT) > 0) {
                    return true;
                }
            } else {
                iovec part{bytes, sizeof bytes};
                alignas(cmsghdr) char control[64];
                msghdr m{nullptr, 0, &part, 1, control, sizeof control, 0};
                if (::recvmsg(socket_.get(), &m, wait_ == Wait::block ? 0 : MSG_DONTWAIT) > 0) {
                    timespec t{};
                    if (const auto* c = CMSG_FIRSTHDR(&m)) {
                        std::memcpy(&t, CMSG_DATA(c), sizeof t);
                    }
                    one_way_us = static_cast<double>(t.tv_sec * 1'000'000'000LL + t.tv_nsec -
                                                     time_in(bytes)) /
                                 1000;
                    return true;
                }
            }
            if (link::monotonic_ns() >= until) return false;
        }
    }

private:
    const Wait wait_;
    const bool stamps_;
    link::Descriptor socket_;
};

class Ours {
public:
    Ours(const std::string& interface, Wait wait, bool stamps) : stamps_(stamps) {
        constexpr ethernet::Policy policies[] = {ethernet::Policy::spin, ethernet::Policy::block,
                                                 ethernet::Policy::hybrid};
        const auto policy = policies[static_cast<int>(wait)];
        auto opened = ethernet::open("eth:" + interface,
                                     {.types = {type}, .policy = policy, .spin_ns = spin_ns});
        if (!opened) throw std::runtime_error(opened.problem);
        port_ = std::move(opened.port);
        for (int i = 0; i < 1000 && !port_->statistics().up; ++i) {
            sleep_until(link::monotonic_ns() + period_ns);
        }
    }
    void send(Bytes& f) {
        port_->send(f, {.stamp_at = static_cast<std::uint16_t>(stamps_ ? 22 : 0)}, 0);
    }
    bool receive(std::int64_t until, double& one_way_us) {
        if (!port_->wait(until)) return false;
        const auto arrival = port_->receive(0);
        if (!arrival) return false;
        const auto sent = static_cast<std::int64_t>(
            __builtin_bswap64(static_cast<std::uint64_t>(time_in(arrival->bytes.data()))));
        one_way_us = static_cast<double>(arrival->time_ns - sent) / 1000;
        return true;
    }

private:
    const bool stamps_;
    std::unique_ptr<ethernet::Port> port_;
};

struct Exchange {
    std::vector<double> round_trips, one_ways;  // us
    int missed = 0;
};

/// `count` frames there and back: one after the other, or one each millisecond.
template <class End>
Exchange exchange(const std::string& a, const std::string& b, int cpu_a, int cpu_b, Wait wait,
                  bool paced, int count) {
    Exchange result;
    result.round_trips.reserve(static_cast<std::size_t>(count));

    result.one_ways.reserve(static_cast<std::size_t>(count));
    End here(a, wait, paced), there(b, wait, paced);
    std::atomic<bool> done{false};
    const auto start = link::monotonic_ns() + 20 * period_ns;
    constexpr std::int64_t timeout_ns = 50'000;  // of the end that expects a frame at its time
    std::thread echo([&] {
        run_real_time(cpu_b, [&] {
            double one_way = 0;
            for (std::int64_t due = start; !done.load(std::memory_order_relaxed);) {
                const auto now = link::monotonic_ns();
                if (paced) {
                    while (due + timeout_ns <= now) {
                        due += period_ns;
                    }
                }
                if (!there.receive(paced ? due + timeout_ns : now + 10 * period_ns, one_way)) {
                    continue;
                }
                Bytes f = broadcast_frame();
                there.send(f);
                if (paced) {
                    result.one_ways.push_back(one_way);
                    due += period_ns;
                }
            }
        });
    });
    run_real_time(cpu_a, [&] {
        double ignored = 0;
        sleep_until(start - period_ns);
        for (int i = 0; i < count; ++i) {
            Bytes f = broadcast_frame();
            if (paced) {
                const auto due = start + i * period_ns;
                if (due - link::monotonic_ns() > spin_ns) {
                    sleep_until(due - spin_ns);
                }
                while (link::monotonic_ns() < due) {
                }
            }
            const auto sent = link::monotonic_ns();
            here.send(f);
            const bool came = here.receive(sent + (paced ? spin_ns : 100 * period_ns), ignored);
            if (came) {
                result.round_trips.push_back(static_cast<double>(link::monotonic_ns() - sent) /
                                             1000);
            } else {
                ++result.missed;
            }
        }
    });
    done = true;
    echo.join();
    return result;
}

/// Of the rounds: the median p50 and the best p99, as the tails are the machine's.
class Rounds {
public:
    void add(std::vector<double>& samples) {
        if (samples.empty()) return;
        p50_.push_back(quantile(samples, 0.5));
        p99_.push_back(quantile(samples, 0.99));
    }
    std::optional<double> p50() {
        return p50_.empty() ? std::nullopt : std::optional(median(p50_));
    }
    std::optional<double> p99() {
        return p99_.empty() ? std::nullopt : std::optional(quantile(p99_, 0.0));
    }

private:
    std::vector<double> p50_, p99_;
};

/// How late frames leave that a pacer is to send every millisecond, by the stamp they are given.
Rounds pacer(const std::string& interface, int cpu, int rounds, int count) {
    Rounds result;
    ethernet::Options options{.types = {type},
                              .spin_ns = spin_ns,
                              .pacer = true,
                              .pacer_priority = priority,
                              .pacer_cpu = cpu};
    auto opened = ethernet::open("eth:" + interface, options);
    if (!opened) throw std::runtime_error(opened.problem);
    for (int round = 0; round < rounds; ++round) {
        std::vector<double> late;
        auto due = link::monotonic_ns() + 5 * period_ns;
        for (int i = 0; i < count; ++i, due += period_ns) {
            sleep_until(due - period_ns / 2);
            const Bytes f = broadcast_frame();
            opened.port->send(f, {.at_ns = due, .stamp_at = 22}, link::monotonic_ns());
            sleep_until(due + period_ns / 4);
            late.push_back(static_cast<double>(opened.port->statistics().launch_error_ns) / 1000);
        }
        result.add(late);
    }
    return result;
}

void measure(const Options& options, Report& report) {
    const std::string a = "bench0";
    const std::string b = "bench1";
    if (std::system("ip link add bench0 type veth peer name bench1 2>/dev/null && ip link set "
                    "bench0 up && ip link set bench1 up") != 0) {
        return report.note("no veth pair can be made here (`ip` of iproute2)");
    }
    const int last = options.cpu, other = last > 0 ? last - 1 : last,
              rounds = options.quick ? 2 : 5;
    const int many = options.quick ? 5'000 : 20'000;
    const int cycles = options.quick ? 500 : 3'000;
    struct Case {
        const char* what;
        const char* peer;
        Wait wait;
        bool paced, same_cpu;
        Rounds ours{};
        Rounds plain{};
        Rounds our_way{};
        Rounds plain_way{};
    } cases[] = {
        {"round trip, both ends polling", "recv without waiting", Wait::spin, false, false},
        {"round trip, both ends blocking on one CPU", "recv", Wait::block, false, true},
        {"round trip in a 1 ms cycle, both ends hybrid", "sleep, then recv without waiting",
         Wait::hybrid, true, false},
    };
    int missed = 0;
    for (int round = 0; round < rounds; ++round) {
        for (Case& c : cases) {
            const int far = c.same_cpu ? last : other;
            const int count = c.paced ? cycles : many;
            Exchange floor = exchange<Plain>(a, b, last, far, c.wait, c.paced, count);
            Exchange ours = exchange<Ours>(a, b, last, far, c.wait, c.paced, count);
            c.plain.add(floor.round_trips);
            c.ours.add(ours.round_trips);
            c.plain_way.add(floor.one_ways);
            c.our_way.add(ours.one_ways);
            missed += ours.missed;
        }
    }
    for (Case& c : cases) {
        // Blocking with a deadline is a system call (ppoll) that plain recv is not: no aim, but to
        // be known.
        const Goal goal = c.wait == Wait::block ? Goal{} : not_above();
        report.row(
            {fmt::format("{}, p50", c.what), "us", c.ours.p50(), c.peer, c.plain.p50(), goal});
        report.row({"  p99 of the best round", "us", c.ours.p99(), c.peer, c.plain.p99(), {}});
    }
    Case& paced = cases[2];
    const char* const stamp = "SO_TIMESTAMPNS";
    report.row({"one way by the kernel's stamp, 1 ms cycle, p50", "us", paced.our_way.p50(), stamp,
                paced.plain_way.p50(), at_most(1.2)});
    report.row(
        {"  p99 of the best round", "us", paced.our_way.p99(), stamp, paced.plain_way.p99(), {}});
    Rounds late = pacer(a, last, options.quick ? 1 : 3, cycles / 3);
    report.row(
        {.what = "how late the pacer lets a frame leave, p50", .unit = "us", .ours = late.p50()});
    report.row({.what = "  p99 of the best round", .unit = "us", .ours = late.p99()});
    report.note(
        fmt::format("{} rounds in turn, SCHED_FIFO {}; median of the p50; {} of our exchanges got "
                    "no answer in time",
                    rounds, priority, missed));
}

}  // namespace

void raw_ethernet(const Options& options, Report& report) {
    report.section("Raw Ethernet over a veth pair");
    if (!in_own_network([&] { measure(options, report); })) {
        report.note("no network namespace may be made here: run as root");
    }
}

}  // namespace hal::bench
