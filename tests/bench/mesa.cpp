// SPDX-License-Identifier: MIT
// A Mesa card at 1 kHz: what `read` and `write` take in a cycle, beside a loop that receives the same
// answer and sends the same request. The card is emulated, in a process of its own at the other end
// of a veth pair.
#include "mesa.hpp"

#include <arpa/inet.h>
#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <fmt/core.h>
#include <mutex>
#include <stdexcept>
#include <thread>

#include "drivers/link/system.hpp"
#include "machine.hpp"
#include "mesa/lbp16/packet.hpp"
#include "process.hpp"
#include "runtime.hpp"
#include "sample.hpp"
#include "segment.hpp"

namespace hal::bench {
namespace {

constexpr std::uint16_t port = 27181;
constexpr const char* host_address = "10.27.91.1";
constexpr const char* card_address = "10.27.91.2";
constexpr const char* tap_address = "127.27.91.2";
constexpr std::int64_t period_ns = 1'000'000;
constexpr std::size_t turns = 6;  // of a round
using Bytes = std::vector<std::uint8_t>;

sockaddr_in address_of(const char* host) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    inet_pton(AF_INET, host, &address.sin_addr);
    return address;
}
const sockaddr* any(const sockaddr_in& address) {
    return reinterpret_cast<const sockaddr*>(&address);
}
link::Descriptor socket_to_card() {
    link::Descriptor socket(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
    const sockaddr_in card = address_of(card_address);
    if (::connect(socket.get(), any(card), sizeof card) != 0) {
        throw std::runtime_error("no socket to the card");
    }
    return socket;
}

/// Passes datagrams between a driver and the card, and keeps the newest request that has an answer.
class Tap {
public:
    Tap() : driver_(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)), card_(socket_to_card()) {
        const sockaddr_in own = address_of(tap_address);
        if (::bind(driver_.get(), any(own), sizeof own) != 0) {
            throw std::runtime_error(fmt::format("{} is in use", tap_address));
        }
        thread_ = std::thread([this] { pass(); });
    }
    ~Tap() {
        quit_ = true;
        thread_.join();
    }
    Bytes request() {
        const std::lock_guard lock(mutex_);
        return request_;
    }

private:
    void pass() {
        std::array<std::uint8_t, mesa::max_datagram> bytes{};
        sockaddr_in from{};
        while (!quit_) {
            std::array<pollfd, 2> ready{{{driver_.get(), POLLIN, 0}, {card_.get(), POLLIN, 0}}};
            if (::poll(ready.data(), ready.size(), 20) <= 0) continue;
            if ((ready[0].revents & POLLIN) != 0) {
                socklen_t length = sizeof from;
                const auto size = ::recvfrom(driver_.get(), bytes.data(), bytes.size(), 0,
                                             reinterpret_cast<sockaddr*>(&from), &length);
                if (size <= 0) continue;
                newest_.assign(bytes.begin(), bytes.begin() + size);
                (void)!::send(card_.get(), bytes.data(), static_cast<std::size_t>(size), 0);
            }
            if ((ready[1].revents & POLLIN) != 0) {
                const auto size = ::recv(card_.get(), bytes.data(), bytes.size(), 0);
                if (size <= 0) continue;
                (void)!::sendto(driver_.get(), bytes.data(), static_cast<std::size_t>(size), 0,
                                any(from), sizeof from);
                const std::lock_guard lock(mutex_);
                request_ = newest_;
            }
        }
    }

    link::Descriptor driver_, card_;
    Bytes newest_;  // of the thread
    std::mutex mutex_;
    Bytes request_;
    std::atomic<bool> quit_{false};
    std::thread thread_;
};

/// The command of a card at the other end of a veth pair. It awaits a line, before which that end
/// has to be in its network.
std::vector<std::string> card_command(const Options& options, const std::string& file) {
    const std::string address = fmt::format("ip address add {}/24 dev card0", card_address);
    const std::string script = fmt::format(
        "echo ready; read line; {} && ip link set card0 up && exec '{}/hal' node mesa '{}' "
        "--address {}",
        address, options.programs, file, card_address);
    std::vector<std::string> command = {"unshare", "--net", "sh", "-c", script};
    // at a real-time priority, because an answer that is late is another measurement
    if (run({.arguments = {"chrt", "--fifo", "30", "true"}}).status == 0) {
        command.insert(command.begin(), {"chrt", "--fifo", "30"});
    }
    return command;
}

/// Connects this network with that of the process.
bool make_wire(pid_t card) {
    const std::string commands = fmt::format(
        "ip link set lo up && ip link add host0 type veth peer name card0 && ip link set card0 "
        "netns {} && ip address add {}/24 dev host0 && ip link set host0 up",
        card, host_address);
    return std::system(("( " + commands + " ) 2>/dev/null").c_str()) == 0;
}

void sleep_ms(int ms) { std::this_thread::sleep_for(std::chrono::milliseconds(ms)); }

std::string netlist(const Options& options, const char* host) {
    const std::string card = "hm2_7i76e.0";
    std::string text = new_thread("t", period_ns, options.cpu);
    text += fmt::format("loadrt mesa board=eth:{}\naddf {}.read t\naddf {}.write t\n", host, card,
                        card);
    text +=
        fmt::format("setp {0}.watchdog.timeout_ns 1000000000\nsetp {0}.hold-cycles 500\n", card);
    for (int unit = 0; unit < 5; ++unit) {
        text += fmt::format("setp {0}.stepgen.{1:02}.enable 1\n", card, unit);
    }
    return text;
}

/// The request of a cycle, as the driver sends it when no setting changes.
Bytes request_of_a_cycle(const Options& options) {
    Tap tap;
    Runtime runtime;
    runtime.apply(netlist(options, tap_address));
    runtime.session.threads().start();
    sleep_ms(500);
    const Bytes request = tap.request();
    runtime.session.threads().stop();
    return request;
}

/// Times of a cycle in us; one cycle in two is seen.
template <class Read>
std::vector<double> watch(const Options& options, Read read) {
    std::vector<double> samples;
    const std::size_t count = (options.quick ? 600 : 3000) / turns;
    while (samples.size() < count) {
        std::this_thread::sleep_for(std::chrono::microseconds(1700));
        samples.push_back(static_cast<double>(read()) / 1000.0);
    }
    return samples;
}

/// The share of the cycles without an answer, in one of the turns, is added to `lost`.
std::vector<double> driver_times(const Options& options, double& lost) {
    Runtime runtime;
    runtime.apply(netlist(options, card_address));
    runtime.session.threads().start();
    const Thread& thread = *runtime.session.model().threads.front();
    sleep_ms(100);
    std::vector<double> samples =
        watch(options, [&] { return __atomic_load_n(&thread.time.slot->s32, __ATOMIC_RELAXED); });
    const auto count = [&](const char* pin) {
        const auto values = runtime.session.values().read({std::string("hm2_7i76e.0.") + pin});
        return static_cast<double>(values.at(0).value().value.u64);
    };
    lost += count("lost-requests") / std::max(count("requests"), 1.0) / turns;
    runtime.session.threads().stop();
    return samples;
}

std::vector<double> loop_times(const Options& options, const Bytes& request, double& lost) {
    std::atomic<std::uint64_t> cycles{0};
    std::atomic<std::uint64_t> answers{0};
    const link::Descriptor socket = socket_to_card();
    std::array<std::uint8_t, mesa::max_datagram> answer{};
    PeriodicThread thread(options.cpu, period_ns, [&](std::uint64_t) {
        cycles.fetch_add(1, std::memory_order_relaxed);
        if (::recv(socket.get(), answer.data(), answer.size(), MSG_DONTWAIT) > 0) {
            answers.fetch_add(1, std::memory_order_relaxed);
        }
        (void)!::send(socket.get(), request.data(), request.size(), MSG_DONTWAIT);
    });
    sleep_ms(100);
    std::vector<double> samples = watch(options, [&] { return thread.last_ns(); });
    const auto all = static_cast<double>(std::max<std::uint64_t>(cycles, 1));
    lost += (1.0 - static_cast<double>(answers) / all) / turns;
    return samples;
}

void measure(const Options& options, Report& report) {
    const TemporaryFolder folder;
    const std::string file = folder.file(
        "card.mesa", "[card]\ntype = 7i76e\nremotes = none\n[motor x]\nstepgen = 0\nencoder = 0\n");
    Child card({.arguments = card_command(options, file)}, true);
    if (!card.line(10'000)) throw std::runtime_error("the emulated card does not start");
    if (!make_wire(card.pid())) throw std::runtime_error("no veth pair");
    card.write("\n");
    if (!card.line(10'000)) throw std::runtime_error("the emulated card does not start");
    const Bytes request = request_of_a_cycle(options);
    if (request.empty()) throw std::runtime_error("the driver sent no request");
    report.note(fmt::format("the request of a cycle has {} bytes", request.size()));
    for (int round = 1; round <= 3; ++round) {
        std::vector<double> ours;
        std::vector<double> loop;
        double lost = 0.0;
        double loop_lost = 0.0;
        // in short turns, because other work on the machine comes and goes
        for (std::size_t turn = 0; turn < turns; ++turn) {
            const std::vector<double> driver = driver_times(options, lost);
            const std::vector<double> bare = loop_times(options, request, loop_lost);
            ours.insert(ours.end(), driver.begin(), driver.end());
            loop.insert(loop.end(), bare.begin(), bare.end());
        }
        report.row({fmt::format("round {}: p50", round), "us", median(ours), "bare loop",
                    median(loop), at_most(1.1)});
        report.row({fmt::format("round {}: p99", round), "us", quantile(ours, 0.99), "bare loop",
                    quantile(loop, 0.99), at_most(1.1)});
        report.note(
            fmt::format("without an answer in time: {:.2f} % of the cycles, of the loop {:.2f} %",
                        lost * 100, loop_lost * 100));
    }
}

}  // namespace

void mesa_card(const Options& options, Report& report) {
    report.section("Mesa card: read and write at 1 kHz, 5 step generators and an encoder");
    if (!in_own_network([&] { measure(options, report); })) {
        report.note("not measured: no network namespace may be made here");
    }
}

}  // namespace hal::bench
