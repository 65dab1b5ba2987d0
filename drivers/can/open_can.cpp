// SPDX-License-Identifier: MIT
// The table from CAN address to driver.
#include <charconv>
#include <optional>

#include "can/cane/cane.hpp"
#include "can/journal/journaled_link.hpp"
#include "can/journal/ordered_link.hpp"
#include "can/replay/can_replay.hpp"
#include "can/scocan/scocan_link.hpp"
#include "can/sim/sim_can.hpp"
#include "can/slcan/slcan.hpp"
#include "can/socketcan/socketcan.hpp"
#include "can/udp/can_udp.hpp"
#include "link/address.hpp"
#include "link/can.hpp"

namespace hal::can {

namespace {

using Driver = link::Driver<Opened, Options, Description>;
using Journal = Driver::Journal;

constexpr Driver drivers[] = {
    {link::form_of(address_forms, "can"), socketcan::open, socketcan::describe},
    {link::form_of(address_forms, "sim"),
     simbus::open,
     simbus::describe,
     nullptr,
     nullptr,
     {},
     Journal::order},
    {link::form_of(address_forms, "udp"), canudp::open, canudp::describe, nullptr, nullptr,
     "restart"},
    {link::form_of(address_forms, "slcan"), slcan::open, slcan::describe, nullptr, nullptr,
     "own errors restart receivequeue"},
    {link::form_of(address_forms, "cane"), cane::open, cane::describe, cane::is_own_option,
     cane::own_options, "bitrate datarate own errors restart", Journal::carrier},
    {link::form_of(address_forms, "scocan"), scocan::open, scocan::describe, scocan::is_own_option,
     scocan::own_options, "bitrate datarate fd own errors stamps restart", Journal::order},
    {link::form_of(address_forms, "replay"), replay::open, replay::describe, nullptr, nullptr,
     "own restart sendqueue receivequeue"},
};

/// Parses 500000, 500k, 1M, unlimited.
std::optional<std::uint32_t> rate(std::string_view text) {
    if (text == "unlimited") return unlimited;
    double value = 0;
    const auto [end, wrong] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (wrong != std::errc{}) return std::nullopt;
    const std::string_view unit(end, static_cast<std::size_t>(text.data() + text.size() - end));
    if (unit == "k") {
        value *= 1e3;
    } else if (unit == "M") {
        value *= 1e6;
    } else if (unit.empty()) {
        value *= 1.0;
    } else {
        value *= -1.0;
    }
    if (!(value >= 1.0 && value <= 20e6)) return std::nullopt;
    return static_cast<std::uint32_t>(value);
}

/// Applies a bit rate.
template <auto member>
std::string set_rate(const link::AddressOption& option, Options& options) {
    const auto bits = rate(option.value);
    if (!bits) {
        return link::invalid_value(option, "bits per second, as in 500000, 500k or 1M");
    }
    options.*member = *bits;
    return {};
}

std::string set_data_rate(const link::AddressOption& option, Options& options) {
    options.fd = true;
    return set_rate<&Options::data_rate>(option, options);
}

constexpr link::OptionRow<Options> options_of_can[] = {
    {"bitrate", set_rate<&Options::bit_rate>},
    {"datarate", set_data_rate},
    {"fd", link::set_flag<&Options::fd>},
    {"listen", link::set_flag<&Options::listen_only>},
    {"own", link::set_flag<&Options::own_frames>},
    {"errors", link::set_flag<&Options::error_frames>},
    {"stamps", link::set_flag<&Options::stamps>},
    {"restart", link::set_number<&Options::restart_ms, 0, 3'600'000>},
    {"sendqueue", link::set_number<&Options::send_capacity, 0, 65536>},
    {"receivequeue", link::set_number<&Options::receive_capacity, 0, 65536>},
};

}  // namespace

Opened open(std::string_view address, const Options& given) {
    return link::open_address<Opened, Options, Description>(
        address, given, drivers, options_of_can, "a CAN bus",
        {journal::open_journaled, journal::open_ordered});
}

Description describe(std::string_view address) {
    return link::describe_address<Opened, Options, Description>(address, drivers);
}

}  // namespace hal::can
