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

/// Applies 150us, 1ms, 20000ns.
template <auto member>
std::string set_duration(const link::AddressOption& option, Options& options) {
    constexpr struct {
        std::string_view name;
        double ns;
    } units[] = {{"ns", 1.0}, {"us", 1e3}, {"ms", 1e6}};
    const char* const last = option.value.data() + option.value.size();
    double number = 0;
    const auto [end, error] = std::from_chars(option.value.data(), last, number);
    const std::string_view name(end, static_cast<std::size_t>(last - end));
    for (const auto& unit : units) {
        if (error != std::errc{} || unit.name != name) continue;
        number *= unit.ns;
        if (!(number >= 0.0 && number <= 1e9)) break;
        options.*member = static_cast<std::int64_t>(number);
        return {};
    }
    return link::invalid_value(option, "a time up to 1 s with its unit, as in 150us");
}

std::string set_policy(const link::AddressOption& option, Options& options) {
    constexpr std::string_view words[] = {"hybrid", "block", "spin"};
    const auto* const found = std::find(std::begin(words), std::end(words), option.value);
    if (found == std::end(words)) return link::invalid_value(option, "hybrid, block or spin");
    options.policy = static_cast<Policy>(found - std::begin(words));
    return {};
}

std::string set_mac(const link::AddressOption& option, Options& options) {
    const auto address = parse_address(option.value);
    if (!address || ((*address)[0] & 1) != 0 || *address == Address{}) {
        return link::invalid_value(option, "a unicast address, as in 02:00:00:00:00:07");
    }
    options.address = *address;
    return {};
}

constexpr link::OptionRow<Options> options_of_ethernet[] = {
    {"policy", set_policy},
    {"spin", set_duration<&Options::spin_ns>},
    {"pacer", link::set_flag<&Options::pacer>},
    {"priority", link::set_number<&Options::pacer_priority, 1, 99>},
    {"cpu", link::set_number<&Options::pacer_cpu, 0, 1023>},
    {"promiscuous", link::set_flag<&Options::promiscuous>},
    {"txstamps", link::set_flag<&Options::transmit_stamps>},
    {"speed", link::set_number<&Options::speed, 1, 100'000>},
    {"mac", set_mac},
    {"forward", set_duration<&Options::forward_ns>},
    {"noise", set_duration<&Options::noise_ns>},
    {"sendqueue", link::set_number<&Options::send_capacity, 1, 4096>},
    {"receivequeue", link::set_number<&Options::receive_capacity, 1, 16384>},
};

}  // namespace

Opened open(std::string_view address, const Options& given) {
    return link::open_address<Opened, Options, Description>(
        address, given, drivers, options_of_ethernet, "an Ethernet segment",
        {journal::open_journaled, journal::open_ordered});
}

Description describe(std::string_view address) {
    return link::describe_address<Opened, Options, Description>(address, drivers);
}

}  // namespace hal::ethernet
