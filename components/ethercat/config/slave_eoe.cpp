// SPDX-License-Identifier: MIT
// Ethernet over EtherCAT in a `.ethercat` file: `eoe` of a slave, `eoe-switch` of the bus.
#include <arpa/inet.h>

#include <algorithm>
#include <bit>

#include "ethercat/config/config_text.hpp"
#include "link/ethernet.hpp"

namespace hal::ethercat::config {

namespace {

namespace flag = eoe::ip_flag;

constexpr const char* expected =
    "yes, dhcp, or an address with its prefix, as in 192.168.2.10/24; gateway ADDRESS, dns "
    "ADDRESS, mac ADDRESS, interface NAME and host "
    "ADDRESS may follow";

std::optional<std::uint32_t> ip_address(const std::string& text) {
    in_addr parsed{};
    if (inet_pton(AF_INET, text.c_str(), &parsed) != 1) {
        return {};
    }
    return ntohl(parsed.s_addr);
}

/// Parses an address with its prefix: 192.168.2.10/24.
std::optional<std::pair<std::uint32_t, unsigned>> ip_network(const std::string& text) {
    const std::size_t slash = text.find('/');
    if (slash == text.npos) {
        return {};
    }
    const auto ip = ip_address(text.substr(0, slash));
    const auto bits = parse_natural(std::string_view(text).substr(slash + 1));
    if (!ip || !bits || *bits < 1 || *bits > 30) {
        return {};
    }
    return std::pair(*ip, static_cast<unsigned>(*bits));
}

constexpr std::uint32_t mask_of(unsigned prefix) { return ~std::uint32_t{0} << (32 - prefix); }

std::string ip_text(std::uint32_t ip) {
    std::string text;
    for (int shift = 24; shift >= 0; shift -= 8) {
        text += (text.empty() ? "" : ".") + std::to_string(ip >> shift & 0xff);
    }
    return text;
}

bool is_interface(const std::string& name) {
    return !name.empty() && name.size() <= 15 && name != "." && name != ".." &&
           std::all_of(name.begin(), name.end(), [](char c) {
        return c > ' ' && c < 127 && c != '/' && c != ':' && c != '%';
    });
}

/// Returns a locally administered MAC address of a slave, the same at each start.
std::array<std::uint8_t, 6> usual_mac(const Bus& bus, std::size_t slave) {
    std::uint8_t sum = 0;
    for (const char c : bus.link) {
        sum = static_cast<std::uint8_t>(sum * 31 + static_cast<unsigned char>(c));
    }
    return {0x02,
            0xec,
            0xa7,
            sum,
            static_cast<std::uint8_t>(slave >> 8),
            static_cast<std::uint8_t>(slave)};
}

class EoeReader {
public:
    EoeReader(SlaveInput in, const Line& line) : in_(in), line_(line) {}

    void read() {
        const auto words = words_of(line_.value);
        in_.slave.eoe = true;
        std::size_t at = 1;
        if (words.empty()) return in_.keys.reject(line_, expected);
        if (const auto network = ip_network(words[0].text)) {
            prefix_ = network->second;
            // no gaps: slaves disagree on them
            ip_.flags = flag::mac | flag::address | flag::mask | flag::gateway | flag::dns;
            ip_.address = network->first;
            ip_.mask = mask_of(prefix_);
        } else if (same_word(words[0].text, "dhcp")) {
            ip_.flags = flag::mac;
        } else if (!same_word(words[0].text, "yes")) {
            at = 0;  // only options
        }
        for (; at < words.size(); at += 2) {
            if (at + 1 == words.size()) return in_.keys.reject(line_, expected);
            if (!option(lower(words[at].text), words[at + 1].text)) {
                return in_.keys.reject(line_, expected);
            }
        }
        if (in_.info.eoe.ip != 0 && (ip_.flags & flag::address) == 0) {
            return in_.keys.reject(
                line_,
                "the address of the slave before `host`, as in 192.168.2.10/24 host 192.168.2.1");
        }
        in_.info.eoe.prefix = prefix_;
        if (ip_.flags != 0) {
            in_.slave.eoe_ip = ip_;
        }
    }

private:
    bool option(const std::string& key, const std::string& value) {
        const auto address = ip_address(value);
        const bool has_address = (ip_.flags & flag::address) != 0;
        if (key == "gateway" && address && has_address) {
            ip_.gateway = *address;
            return true;
        }
        if (key == "dns" && address && has_address) {
            ip_.dns = *address;
            return true;
        }
        if (key == "host" && address) {
            in_.info.eoe.ip = *address;
            return true;
        }
        if (key == "interface" && is_interface(value)) {
            in_.info.eoe.name = value;
            return true;
        }
        const auto mac = key == "mac" ? ethernet::parse_address(value) : std::nullopt;
        if (!mac || ((*mac)[0] & 1) != 0) return false;
        ip_.flags |= flag::mac;
        ip_.mac = *mac;
        return true;
    }

    SlaveInput in_;
    const Line& line_;
    eoe::Ip ip_;
    unsigned prefix_ = 24;
};

}  // namespace

void read_eoe(SlaveInput in) {
    const Line* line = in.keys.find("eoe");
    if (line == nullptr || same_word(line->value.text, "no")) return;
    EoeReader(in, *line).read();
}

const char* const expected_eoe_switch =
    "an interface name and perhaps an address with its prefix, as in eoe0 192.168.2.1/24";

bool read_eoe_switch(Bus& bus, const Line& line) {
    const auto words = words_of(line.value);
    if (words.empty() || words.size() > 2 || !is_interface(words[0].text)) return false;
    bus.eoe_switch.name = words[0].text;
    if (words.size() == 1) return true;
    const auto network = ip_network(words[1].text);
    if (!network) return false;
    bus.eoe_switch.ip = network->first;
    bus.eoe_switch.prefix = network->second;
    return true;
}

namespace {

/// Completes the interface of a slave, and checks that it is one.
void complete_eoe(Bus& bus, std::size_t n, Report& report) {
    master::Slave& slave = bus.setup.slaves[n];
    HostInterface& host = bus.slaves[n].eoe;
    const Span at = bus.slaves[n].at;
    const bool switched = !bus.eoe_switch.name.empty();
    if (switched && (!host.name.empty() || host.ip != 0)) {
        report.error(Topic::slave, at,
                     "`interface` and `host` of '" + slave.name +
                         "' do not apply: all slaves are at " + bus.eoe_switch.name,
                     "delete them from `eoe`, or delete `eoe-switch` in [bus]");
    }
    if (!switched && host.name.empty()) {
        host.name = "eoe-" + slave.name;
        if (!is_interface(host.name)) {
            report.error(
                Topic::slave, at,
                "'" + host.name +
                    "' is too long for the name of an interface: at most 15 characters",
                "write a shorter one at the end of `eoe`: interface eoe" + std::to_string(n));
        }
    }
    if (auto& ip = slave.eoe_ip; ip && ip->mac == std::array<std::uint8_t, 6>{}) {
        ip->mac = usual_mac(bus, n);
    }
}

/// Reports what slave `n` has in common with the earlier slave `m`.
void compare_eoe(const Bus& bus, std::size_t n, std::size_t m, Report& report) {
    const std::string first = "first in line " + std::to_string(bus.slaves[m].at.line);
    const auto duplicate = [&](const std::string& what, const std::string& more = {}) {
        report.error(Topic::slave, bus.slaves[n].at, "duplicate " + what, first + more,
                     "duplicate");
    };
    const std::string& name = bus.slaves[n].eoe.name;
    if (bus.eoe_switch.name.empty() && name == bus.slaves[m].eoe.name) {
        duplicate("interface '" + name + "'",
                  "; for one interface of all, write eoe-switch = " + name + " in [bus]");
    }
    const auto& a = bus.setup.slaves[n].eoe_ip;
    const auto& b = bus.setup.slaves[m].eoe_ip;
    if (a && b && a->address != 0 && a->address == b->address) {
        duplicate("IP address " + ip_text(a->address));
    }
    if (a && b && a->mac == b->mac) {
        duplicate("MAC address " + ethernet::to_string(a->mac));
    }
}

}  // namespace

void check_eoe(Bus& bus, Report& report) {
    const auto& slaves = bus.setup.slaves;
    bool any = false;
    for (std::size_t n = 0; n < slaves.size(); ++n) {
        if (!slaves[n].eoe) continue;
        any = true;
        complete_eoe(bus, n, report);
        for (std::size_t m = 0; m < n; ++m) {
            if (slaves[m].eoe) {
                compare_eoe(bus, n, m, report);
            }
        }
    }
    if (!any && !bus.eoe_switch.name.empty()) {
        report.warning(Topic::line, bus.at, "`eoe-switch` without a slave that has `eoe`",
                       "write eoe = 192.168.2.10/24 in the section of a slave, or delete it");
    }
}

}  // namespace hal::ethercat::config
