// SPDX-License-Identifier: MIT
#include "gateway_lss.hpp"

#include <cstdio>

#include "text/quoting.hpp"

namespace hal::canopen::gateway {

namespace {

std::string hexadecimal(std::uint32_t value) {
    char text[16];
    std::snprintf(text, sizeof text, "0x%08X", static_cast<unsigned>(value));
    return text;
}

std::string identity_text(const canopen::Identity& identity) {
    std::string text;
    for (const std::uint32_t part : identity) {
        append_item(text, hexadecimal(part), " ");
    }
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

Error lss_argument_error(const Command& c) {
    if (fits(c)) return Error::none;
    if (c.verb == Verb::lss_bit_rate) return Error::lss_bit_rate;
    if (c.verb == Verb::lss_set_node) return Error::lss_node_id;
    return Error::syntax;
}

/// Returns false while the transmit queue is full.
bool LssJob::begin(const Command& c, LssMaster& lss, Time now) const {
    const auto& n = c.numbers;
    switch (c.verb) {
    case Verb::lss_switch_global: return lss.switch_global(n[0] != 0);
    case Verb::lss_switch_selective: return lss.select({n[0], n[1], n[2], n[3]}, now);
    case Verb::lss_set_node: return lss.configure_node_id(static_cast<std::uint8_t>(n[0]), now);
    case Verb::lss_bit_rate: return lss.configure_bit_timing(static_cast<std::uint8_t>(n[1]), now);
    case Verb::lss_activate: return lss.activate_bit_timing(static_cast<std::uint16_t>(n[0]));
    case Verb::lss_store: return lss.store_configuration(now);
    case Verb::lss_inquire: return lss.inquire(n.empty() ? part_ : n[0], now);
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

std::optional<LssJob::Response> LssJob::proceed(const Command& c, LssMaster& lss, bool in_use,
                                                Time now) {
    if (!started_) {
        if (in_use || lss.busy() || !begin(c, lss, now)) return {};
        started_ = true;
    }
    if (lss.busy()) return {};
    const LssMaster::Result& result = lss.result();
    const bool has_no_answer = c.verb == Verb::lss_switch_global || c.verb == Verb::lss_activate;
    if (has_no_answer) return Response{};
    if (!result.answered) return Response{Error::timeout};
    switch (c.verb) {
    case Verb::lss_inquire:
        append_item(text_, hexadecimal(result.value), " ");
        if (!c.numbers.empty() || part_ == 3) return Response{Error::none, text_};
        ++part_;
        started_ = false;  // for the next part
        return {};
    case Verb::lss_get_node: return Response{Error::none, std::to_string(result.value)};
    case Verb::lss_fastscan: return Response{Error::none, identity_text(result.identity)};
    default: return Response{error_of(c.verb, result)};
    }
}

}  // namespace hal::canopen::gateway
