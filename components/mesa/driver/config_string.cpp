// SPDX-License-Identifier: MIT
#include "config_string.hpp"

#include <algorithm>

#include "text/numbers.hpp"
#include "text/suggest.hpp"

namespace hal::mesa {

namespace {

struct Item {
    std::string_view name;
    Tag tag;  ///< none: the driver does not have this module
};

// The names of hostmot2 for modules without a driver here are accepted with 0 or -1.
constexpr Item items[] = {
    {"num_encoders", Tag::encoder},
    {"num_stepgens", Tag::stepgen},
    {"num_pwmgens", Tag::pwm},
    {"num_leds", Tag::led},
    {"num_ssrs", Tag::ssr},
    {"num_inms", Tag::inm},
    {"num_inmuxs", Tag::inmux},
    {"num_inmux", Tag::inmux},
    {"num_outms", Tag::outm},
    {"num_dplls", Tag::dpll},
    {"num_3pwmgens", Tag::three_phase_pwm},
    {"num_uarts", Tag::uart_transmit},
    {"num_pktuarts", Tag::packet_uart_transmit},
    {"num_bspis", Tag::none},
    {"num_resolvers", Tag::none},
    {"num_rcpwmgens", Tag::none},
    {"num_xy2mods", Tag::none},
    {"num_oneshots", Tag::none},
    {"num_periodms", Tag::none},
};
/// The module whose item counts the instances of another one as well.
Tag counted_as(Tag tag) noexcept {
    switch (tag) {
    case Tag::muxed_encoder: return Tag::encoder;
    case Tag::uart_receive: return Tag::uart_transmit;
    case Tag::packet_uart_receive: return Tag::packet_uart_transmit;
    default: return tag;
    }
}
constexpr std::string_view other_items[] = {"enable_raw",     "stepgen_width",  "sserial_port_0",
                                            "sserial_port_1", "sserial_port_2", "sserial_port_3"};
constexpr std::string_view port_prefix = "sserial_port_";

std::vector<std::string> item_names() {
    std::vector<std::string> names;
    for (const Item& item : items) {
        names.emplace_back(item.name);
    }
    names.insert(names.end(), std::begin(other_items), std::end(other_items));
    return names;
}

std::string quoted(std::string_view text) { return "'" + std::string(text) + "'"; }

}  // namespace

ConfigString::Problem ConfigString::parse(std::string_view text) {
    std::size_t begin = 0;
    while (begin < text.size()) {
        if (text[begin] == ' ' || text[begin] == '\t') {
            ++begin;
            continue;
        }
        const std::size_t end = std::min(text.find_first_of(" \t", begin), text.size());
        Problem problem = parse_item(text.substr(begin, end - begin), begin);
        if (!problem.text.empty()) return problem;
        begin = end;
    }
    return {};
}

/// Parses an item KEY=VALUE. Returns what is wrong with it; an empty sentence: nothing.
ConfigString::Problem ConfigString::parse_item(std::string_view item, std::size_t begin) {
    Problem problem{begin, begin + item.size(), {}, {}};
    const std::size_t equals = std::min(item.find('='), item.size());
    const std::string_view key = item.substr(0, equals);
    const std::string_view value = item.substr(std::min(equals + 1, item.size()));
    if (key == "enable_raw") {
        if (item != key && value != "0" && value != "1") {
            problem.text = "invalid enable_raw " + quoted(value) + "; write 1, or 0 for none";
        }
        enable_raw_ = value != "0";
        return problem;
    }
    if (key == "firmware") {
        problem.text = quoted(item) + ": Ethernet cards keep their firmware; it is not loaded here";
        problem.help = "remove it from config=; to write another firmware: mesaflash";
        return problem;
    }
    if (key.starts_with(port_prefix)) return parse_ports(key, value, problem);
    int number = 0;
    const bool is_number = parse_whole(value, number);
    if (key == "stepgen_width") {
        if (!is_number || number < 1 || number > 8) {
            problem.text = "invalid stepgen_width " + quoted(value) + "; write a number 1..8";
        }
        stepgen_width_ = static_cast<unsigned>(number);
        return problem;
    }
    const auto* const known = std::ranges::find(items, key, &Item::name);
    if (known == std::end(items)) {
        problem.text = "unknown item " + quoted(key) + " in config=";
        problem.help = did_you_mean(key, item_names());
        if (problem.help.empty()) {
            problem.help =
                "items are num_encoders=N, num_stepgens=N, num_pwmgens=N, "
                "sserial_port_0=MODES and their like; see: hal doc mesa";
        }
        return problem;
    }
    if (!is_number || number < all) {
        problem.text = "invalid number " + quoted(value) + " of " + std::string(key) +
                       "; write how many are used, or -1 for all";
        return problem;
    }
    if (known->tag == Tag::none && number > 0) {
        problem.text = std::string(key) + "=" + std::string(value) +
                       ": this driver does not support the module";
        problem.help = "LinuxCNC's driver does: loadrt --linuxcnc hm2_eth";
        return problem;
    }
    counts_.push_back({known->tag, number});
    return problem;
}

ConfigString::Problem ConfigString::parse_ports(std::string_view key, std::string_view value,
                                                const Problem& where) {
    Problem problem = where;
    std::size_t port = max_ports;
    if (!parse_whole(key.substr(port_prefix.size()), port) || port >= max_ports) {
        problem.text = "unknown smart-serial port in " + quoted(key);
        problem.help = "ports are sserial_port_0 .. sserial_port_3";
        return problem;
    }
    const bool is_valid = !value.empty() && value.size() <= max_channels &&
                          value.find_first_not_of("0123456789xX") == value.npos;
    if (!is_valid) {
        problem.text = "invalid modes " + quoted(value) + " of " + std::string(key) +
                       "; write up to 8 characters, a digit for the mode of a channel, x for an "
                       "unused one";
        return problem;
    }
    for (std::size_t channel = 0; channel < value.size(); ++channel) {
        const char mode = value[channel];
        modes_[port][channel] = mode == 'x' || mode == 'X' ? -1 : mode - '0';
    }
    return problem;
}

int ConfigString::count(Tag tag) const noexcept {
    const Tag used = counted_as(tag);
    // the last item of several counts
    for (std::size_t n = counts_.size(); n-- > 0;) {
        if (counts_[n].tag == used) return counts_[n].instances;
    }
    return all;
}

int ConfigString::serial_mode(std::size_t port, std::size_t channel) const noexcept {
    if (port >= max_ports || channel >= max_channels) return -1;
    return modes_[port][channel];
}

std::string_view ConfigString::item_of(Tag tag) noexcept {
    const Tag used = counted_as(tag);
    for (const Item& item : items) {
        if (used != Tag::none && item.tag == used) return item.name;
    }
    return {};
}

}  // namespace hal::mesa
