// SPDX-License-Identifier: MIT
// `hal mesa doctor`: losses and round trips on the way to a card.
#include <arpa/inet.h>
#include <ifaddrs.h>

#include <algorithm>
#include <cstring>
#include <fmt/core.h>

#include "bus/json_text.hpp"
#include "bus/mesa/card_identity.hpp"
#include "bus/mesa/options.hpp"
#include "bus/mesa/round_trips.hpp"
#include "cli/other_program.hpp"
#include "cli/output.hpp"
#include "link/system.hpp"
#include "mesa/lbp16/packet.hpp"

namespace hal::tools {

using namespace mesa;

namespace {

/// A bar for each duration, in steps of a factor of two.
std::string histogram(const Trips& trips) {
    std::string text;
    std::size_t begin = 0;
    for (std::int64_t limit_ns = 16'000; begin < trips.ns.size(); limit_ns *= 2) {
        const auto end = static_cast<std::size_t>(std::ranges::upper_bound(trips.ns, limit_ns) -
                                                  trips.ns.begin());
        const std::size_t count = end - begin;
        if (count > 0) {
            const std::size_t length = std::max<std::size_t>(1, count * 50 / trips.ns.size());
            text += fmt::format("{:>10} us  {:>7}  {}\n", fmt::format("<= {}", limit_ns / 1000),
                                count, std::string(length, '#'));
        }
        begin = end;
    }
    return text;
}

/// The network interface through which a host is reached; "": unknown.
std::string interface_to(const std::string& host) {
    const link::Descriptor socket(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(udp_port);
    const std::string name = host.substr(0, host.find(':'));
    if (inet_pton(AF_INET, name.c_str(), &to.sin_addr) != 1) return {};
    sockaddr_in own{};
    socklen_t size = sizeof own;
    if (::connect(socket.get(), reinterpret_cast<sockaddr*>(&to), sizeof to) != 0 ||
        getsockname(socket.get(), reinterpret_cast<sockaddr*>(&own), &size) != 0) {
        return {};
    }
    ifaddrs* all = nullptr;
    if (getifaddrs(&all) != 0) return {};
    std::string found;
    for (const ifaddrs* i = all; i != nullptr; i = i->ifa_next) {
        if (i->ifa_addr == nullptr || i->ifa_addr->sa_family != AF_INET) continue;
        sockaddr_in of{};
        std::memcpy(&of, i->ifa_addr, sizeof of);
        if (of.sin_addr.s_addr == own.sin_addr.s_addr) {
            found = i->ifa_name;
        }
    }
    freeifaddrs(all);
    return found;
}

double us(std::int64_t ns) { return static_cast<double>(ns) / 1e3; }

std::string report_text(const std::string& host, const CardIdentity& card, const Trips& trips) {
    const int lost = trips.lost_requests + trips.lost_replies + trips.lost;
    std::string text = fmt::format("{} at {}\n{} of {} requests answered", card.name, host,
                                   trips.ns.size(), trips.sent);
    if (trips.late > 0) {
        text += fmt::format(", {} of them later than --timeout", trips.late);
    }
    text += fmt::format("; lost: {} requests, {} replies", trips.lost_requests, trips.lost_replies);
    if (trips.lost > 0) {
        text += fmt::format(", {} requests or replies", trips.lost);
    }
    text += fmt::format(" ({:.2f} %)\n", 100.0 * lost / std::max(1, trips.sent));
    if (!trips.ns.empty()) {
        text += fmt::format(
            "round trip: 50 % within {:.0f} us, 99 % within {:.0f} us, longest {:.0f} us\n\n{}",
            us(trips.at(0.5)), us(trips.at(0.99)), us(trips.ns.back()), histogram(trips));
    }
    return text;
}

std::string report_json(const std::string& host, const CardIdentity& card, const Trips& trips) {
    const bool has_trips = !trips.ns.empty();
    return fmt::format(
        R"({{"host":{},"name":{},"sent":{},"answered":{},"late":{},"lost_requests":{},"lost_replies":{},"lost":{},"p50_ns":{},"p99_ns":{},"max_ns":{},"interface":{}}})"
        "\n",
        json_text(host), json_text(card.name), trips.sent, trips.ns.size(), trips.late,
        trips.lost_requests, trips.lost_replies, trips.lost,
        has_trips ? fmt::to_string(trips.at(0.5)) : "null",
        has_trips ? fmt::to_string(trips.at(0.99)) : "null",
        has_trips ? fmt::to_string(trips.ns.back()) : "null", json_text(interface_to(host)));
}

}  // namespace

int run_mesa_doctor(const MesaDoctorOptions& options) {
    if (options.count < 1 || options.count > 10'000'000) {
        return fail(options, "invalid --count; write 1..10000000");
    }
    CardClient card;
    CardIdentity identity;
    std::string problem = card.open(options.words[0], options.timeout_ns);
    if (problem.empty()) {
        problem = read_name(card, identity);
    }
    if (!problem.empty()) return fail(options, problem);
    const Trips trips =
        RoundTrips(card, options.period_ns, options.timeout_ns).measure(options.count);
    const std::string& host = options.words[0];
    if (options.json) return exit_code(print(report_json(host, identity, trips)));
    if (!print(report_text(host, identity, trips))) return 1;
    const std::string interface = interface_to(host);
    if (interface.empty() || interface == "lo") return 0;
    if (!print(fmt::format("\nwhat delays packets on {}:\n", interface))) return 1;
    return run_tool({"doctor", "--udp", "--interface", interface});
}

}  // namespace hal::tools
