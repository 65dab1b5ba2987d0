// SPDX-License-Identifier: MIT
// The table from the address of a device that answers datagrams to its driver.
#include <charconv>

#include "datagram/journaled_datagram.hpp"
#include "datagram/sim_datagram.hpp"
#include "datagram/udp_datagram.hpp"
#include "link/address.hpp"

namespace hal::datagram {

namespace {

using Driver = link::Driver<Opened, Options, Description>;

constexpr Driver datagram_drivers[] = {
    {link::form_of(address_forms, "eth"), udp::open, udp::describe},
    {link::form_of(address_forms, "sim"), sim::open, sim::describe, nullptr, nullptr, "spin",
     Driver::Journal::order},
};

std::string set_spin(const link::AddressOption& option, Options& options) {
    constexpr std::int64_t max_us = 10'000;
    const char* const last = option.value.data() + option.value.size();
    std::int64_t us = -1;
    const auto [end, error] = std::from_chars(option.value.data(), last, us);
    const std::string_view unit(end, static_cast<std::size_t>(last - end));
    if (error != std::errc() || unit != "us" || us < 0 || us > max_us) {
        return link::invalid_value(option, "a duration 0us..10000us");
    }
    options.spin_ns = us * 1000;
    return {};
}

constexpr link::OptionRow<Options> datagram_options[] = {{"spin", set_spin}};

}  // namespace

Opened open(std::string_view address, const Options& given) {
    return link::open_address<Opened, Options, Description>(address, given, datagram_drivers,
                                                            datagram_options, "a card",
                                                            {journal::open_journaled, nullptr});
}

Description describe(std::string_view address) {
    return link::describe_address<Opened, Options, Description>(address, datagram_drivers);
}

std::string address_of(std::string_view host_or_address) {
    const bool is_address = !describe(host_or_address).transport.empty();
    return (is_address ? "" : "eth:") + std::string(host_or_address);
}

Attached attach(std::string_view address, Server& server) {
    const Description description = describe(address);
    if (!description.in_memory) {
        return {nullptr,
                link::quoted(address) + " is not the address of a card in memory; write sim:NAME"};
    }
    Attached attached =
        sim::attach(description.address.substr(description.address.find(':') + 1), server);
    if (!attached) {
        attached.problem = std::string(address) + ": " + attached.problem;
    }
    return attached;
}

}  // namespace hal::datagram
