// SPDX-License-Identifier: MIT
// The LSS commands of the gateway: one at a time on each net, in the order in which they came.
#include <cstdio>

#include "gateway.hpp"

namespace hal::canopen::gateway {

namespace {

std::string hexadecimal(std::uint32_t value) {
    char text[16];
    std::snprintf(text, sizeof text, "0x%08X", static_cast<unsigned>(value));
    return text;
}

/// What a slave's error byte means for the service that got it.
Error error_of(Verb verb, const LssMaster::Result& r) {
    if (r.error == 0) return Error::none;
    if (r.error == 255) return Error::lss_own;
    if (verb == Verb::lss_set_node) return Error::lss_node_id;
    if (verb == Verb::lss_bit_rate) return Error::lss_bit_rate;
    return r.error == 1 ? Error::lss_store : Error::lss_media;
}

bool fits(const Command& c) {
    const auto& n = c.numbers;
    switch (c.verb) {
    case Verb::lss_switch_global: return n[0] <= 1;
    case Verb::lss_set_node: return (n[0] >= 1 && n[0] <= 127) || n[0] == unconfigured;
    case Verb::lss_bit_rate: return n[0] == 0 && n[1] <= 9;
    case Verb::lss_activate: return n[0] <= 65535;
    case Verb::lss_inquire: return n.empty() || n[0] <= 3;
    default: return true;
    }
}

}  // namespace

void Gateway::start_lss(int client, Command&& c, Net& net, Time now) {
    if (fits(c)) {
        enqueue(client, std::move(c), net, 0, now);
    } else {
        reject(client, c.sequence,
               c.verb == Verb::lss_bit_rate   ? Error::lss_bit_rate
               : c.verb == Verb::lss_set_node ? Error::lss_node_id
                                              : Error::syntax);
    }
}

/// Returns false while the transmit queue is full.
bool Gateway::begin_lss(Pending& p, Net& net, Time now) {
    LssMaster& lss = net.lss;
    const auto& n = p.command.numbers;
    switch (p.command.verb) {
    case Verb::lss_switch_global: return lss.switch_global(n[0] != 0);
    case Verb::lss_switch_selective: return lss.select({n[0], n[1], n[2], n[3]}, now);
    case Verb::lss_set_node: return lss.configure_node_id(static_cast<std::uint8_t>(n[0]), now);
    case Verb::lss_bit_rate: return lss.configure_bit_timing(static_cast<std::uint8_t>(n[1]), now);
    case Verb::lss_activate: return lss.activate_bit_timing(static_cast<std::uint16_t>(n[0]));
    case Verb::lss_store: return lss.store_configuration(now);
    case Verb::lss_inquire: return lss.inquire(n.empty() ? p.part : n[0], now);
    case Verb::lss_get_node: return lss.inquire(4, now);
    case Verb::lss_identify:
        return lss.identify({n[0], n[1], n[2], n[4]}, {n[0], n[1], n[3], n[5]}, now);
    case Verb::lss_identify_unconfigured: return lss.identify_unconfigured(now);
    case Verb::lss_fastscan:
        if (!n.empty()) {
            lss.settings().scan_timeout = n[0] * millisecond;
        }
        return lss.scan(now);
    default: return true;
    }
}

bool Gateway::proceed_lss(Pending& p, Time now) {
    Net& net = *nets_[p.net - 1];
    if (!p.lss_started) {
        if (net.lss_owner != nullptr || net.lss.busy() || !begin_lss(p, net, now)) return false;
        net.lss_owner = &p;
        p.lss_started = true;
    }
    if (net.lss.busy()) return false;
    const LssMaster::Result& r = net.lss.result();
    const auto end = [&](Error error, const std::string& text = "OK") {
        net.lss_owner = nullptr;
        if (error != Error::none) {
            reject(p.client, p.command.sequence, error);
        } else {
            answer(p.client, p.command.sequence, text);
        }
        return true;
    };
    // nobody answers these
    if (p.command.verb == Verb::lss_switch_global || p.command.verb == Verb::lss_activate) {
        return end(Error::none);
    }
    if (!r.answered) return end(Error::timeout);
    switch (p.command.verb) {
    case Verb::lss_inquire:
        p.text += (p.text.empty() ? "" : " ") + hexadecimal(r.value);
        if (!p.command.numbers.empty() || p.part == 3) return end(Error::none, p.text);
        ++p.part;
        net.lss_owner = nullptr;
        p.lss_started = false;
        return false;
    case Verb::lss_get_node: return end(Error::none, std::to_string(r.value));
    case Verb::lss_fastscan:
        return end(Error::none, hexadecimal(r.identity[0]) + " " + hexadecimal(r.identity[1]) +
                                    " " + hexadecimal(r.identity[2]) + " " +
                                    hexadecimal(r.identity[3]));
    default: return end(error_of(p.command.verb, r));
    }
}

}  // namespace hal::canopen::gateway
