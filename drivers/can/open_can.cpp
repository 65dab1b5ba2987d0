// SPDX-License-Identifier: MIT
// The table from CAN address to driver.
#include <algorithm>
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
#include "text/numbers.hpp"

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
     scocan::own_options, "bitrate datarate fd own errors stamps restart", Journal::carrier},
    {link::form_of(address_forms, "replay"), replay::open, replay::describe, nullptr, nullptr,
     "own restart sendqueue receivequeue"},
};

using link::quoted;

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

std::optional<std::uint32_t> number(std::string_view text) {
    std::uint32_t value = 0;
    return parse_whole(text, value) ? std::optional(value) : std::nullopt;
}

/// Applies an option. Returns the problem, or "".
std::string apply(std::string_view key, std::string_view value, bool has_value, Options& o) {
    const auto to_flag = [&](bool& flag) { return link::to_flag(key, value, has_value, flag); };
    const auto to_rate = [&](std::uint32_t& to) -> std::string {
        const auto r = rate(value);
        if (!r) {
            return "invalid " + std::string(key) + " " + quoted(value) +
                   "; write bits per second, as in 500000, 500k or 1M";
        }
        to = *r;
        return {};
    };
    const auto to_number = [&](auto& to, std::uint32_t max) -> std::string {
        const auto n = number(value);
        if (!n || *n > max) {
            return "invalid " + std::string(key) + " " + quoted(value) + "; write a number 0.." +
                   std::to_string(max);
        }
        to = *n;
        return {};
    };
    if (key == "bitrate") return to_rate(o.bit_rate);
    if (key == "datarate") {
        o.fd = true;
        return to_rate(o.data_rate);
    }
    if (key == "fd") return to_flag(o.fd);
    if (key == "listen") return to_flag(o.listen_only);
    if (key == "own") return to_flag(o.own_frames);
    if (key == "errors") return to_flag(o.error_frames);
    if (key == "stamps") return to_flag(o.stamps);
    if (key == "restart") return to_number(o.restart_ms, 3'600'000);
    if (key == "sendqueue") return to_number(o.send_capacity, 65536);
    if (key == "receivequeue") return to_number(o.receive_capacity, 65536);
    return std::string(link::no_option) + quoted(key) +
           "; options are bitrate, datarate, fd, listen, own, errors, stamps, restart, sendqueue, "
           "receivequeue";
}

}  // namespace

Opened open(std::string_view address, const Options& given) {
    return link::open_address<Opened, Options, Description>(
        address, given, drivers, apply, "a CAN bus",
        {journal::open_journaled, journal::open_ordered});
}

Description describe(std::string_view address) {
    return link::describe_address<Opened, Options, Description>(address, drivers);
}

}  // namespace hal::can
