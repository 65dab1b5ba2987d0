// SPDX-License-Identifier: MIT
// The table from Ethernet address to driver.
#include <algorithm>
#include <charconv>

#include "ethernet/journal/journaled_port.hpp"
#include "ethernet/journal/ordered_port.hpp"
#include "ethernet/raw/raw_ethernet.hpp"
#include "ethernet/replay/ethernet_replay.hpp"
#include "ethernet/sim/sim_ethernet.hpp"
#include "ethernet/udp/ethernet_udp.hpp"
#include "link/address.hpp"
#include "link/ethernet.hpp"
#include "text/numbers.hpp"

namespace hal::ethernet {

namespace {

using Driver = link::Driver<Opened, Options, Description>;
using Journal = Driver::Journal;

constexpr Driver drivers[] = {
    {link::form_of(address_forms, "eth"), rawether::open, rawether::describe},
    {link::form_of(address_forms, "sim"),
     simbus::open,
     simbus::describe,
     nullptr,
     nullptr,
     {},
     Journal::order},
    {link::form_of(address_forms, "udp"), udp::open, udp::describe, nullptr, nullptr,
     "policy pacer priority cpu promiscuous txstamps speed forward noise mac sendqueue"},
    {link::form_of(address_forms, "replay"), replay::open, replay::describe},
};

using link::quoted;

template <class T>
std::string to_number(std::string_view key, std::string_view value, T& to, long min, long max) {
    long number = 0;
    if (!parse_whole(value, number) || number < min || number > max) {
        return "invalid " + std::string(key) + " " + quoted(value) + "; write a number " +
               std::to_string(min) + ".." + std::to_string(max);
    }
    to = static_cast<T>(number);
    return {};
}

/// Parses 150us, 1ms, 20000ns.
std::string to_duration(std::string_view key, std::string_view value, std::int64_t& to) {
    double number = 0;
    const auto [end, wrong] = std::from_chars(value.data(), value.data() + value.size(), number);
    const std::string_view unit(end, static_cast<std::size_t>(value.data() + value.size() - end));
    if (unit == "ns") {
        number *= 1.0;
    } else if (unit == "us") {
        number *= 1e3;
    } else if (unit == "ms") {
        number *= 1e6;
    } else {
        number *= -1.0;
    }
    if (wrong != std::errc{} || !(number >= 0.0 && number <= 1e9)) {
        return "invalid " + std::string(key) + " " + quoted(value) +
               "; write a time up to 1 s with its unit, as in 150us";
    }
    to = static_cast<std::int64_t>(number);
    return {};
}

std::string to_policy(std::string_view value, Policy& to) {
    constexpr std::string_view words[] = {"hybrid", "block", "spin"};
    const auto* const found = std::find(std::begin(words), std::end(words), value);
    if (found == std::end(words)) {
        return "invalid policy " + quoted(value) + "; write hybrid, block or spin";
    }
    to = static_cast<Policy>(found - std::begin(words));
    return {};
}

/// Applies an option. Returns the problem, or "".
std::string apply(std::string_view key, std::string_view value, bool has_value, Options& o) {
    const auto to_flag = [&](bool& flag) { return link::to_flag(key, value, has_value, flag); };
    if (key == "policy") return to_policy(value, o.policy);
    if (key == "spin") return to_duration(key, value, o.spin_ns);
    if (key == "pacer") return to_flag(o.pacer);
    if (key == "priority") return to_number(key, value, o.pacer_priority, 1, 99);
    if (key == "cpu") return to_number(key, value, o.pacer_cpu, 0, 1023);
    if (key == "promiscuous") return to_flag(o.promiscuous);
    if (key == "txstamps") return to_flag(o.transmit_stamps);
    if (key == "speed") return to_number(key, value, o.speed, 1, 100'000);
    if (key == "forward") return to_duration(key, value, o.forward_ns);
    if (key == "noise") return to_duration(key, value, o.noise_ns);
    if (key == "sendqueue") return to_number(key, value, o.send_capacity, 1, 4096);
    if (key == "receivequeue") return to_number(key, value, o.receive_capacity, 1, 16384);
    if (key == "mac") {
        const auto address = parse_address(value);
        if (!address || ((*address)[0] & 1) != 0 || *address == Address{}) {
            return "invalid mac " + quoted(value) +
                   "; write a unicast address, as in 02:00:00:00:00:07";
        }
        o.address = *address;
        return {};
    }
    return std::string(link::no_option) + quoted(key) +
           "; options are policy, spin, pacer, priority, cpu, promiscuous, txstamps, speed, mac, "
           "forward, noise, sendqueue, receivequeue";
}

}  // namespace

Opened open(std::string_view address, const Options& given) {
    return link::open_address<Opened, Options, Description>(
        address, given, drivers, apply, "an Ethernet segment",
        {journal::open_journaled, journal::open_ordered});
}

Description describe(std::string_view address) {
    return link::describe_address<Opened, Options, Description>(address, drivers);
}

}  // namespace hal::ethernet
