// SPDX-License-Identifier: MIT
// `hal mesa scan`, `info` and `pins`: which cards there are, and what they have.
#include <arpa/inet.h>

#include <fmt/ranges.h>
#include <memory>

#include "bus/json_text.hpp"
#include "bus/mesa/card_identity.hpp"
#include "bus/mesa/options.hpp"
#include "cli/output.hpp"
#include "cli/signals.hpp"
#include "link/system.hpp"
#include "mesa/hostmot2/boards.hpp"
#include "mesa/lbp16/spaces.hpp"
#include "text/numbers.hpp"

namespace hal::tools {

using namespace mesa;

namespace {

constexpr const char* usual_addresses[] = {"10.10.10.10", "192.168.1.121"};
constexpr unsigned min_prefix = 24;  // at most 254 hosts

/// The hosts of HOST or NETWORK/BITS. Returns the problem, or "".
std::string add_hosts(const std::string& text, std::vector<std::string>& hosts) {
    const auto slash = text.find('/');
    if (slash == text.npos) {
        hosts.push_back(text);
        return {};
    }
    const auto bits = parse_natural(text.substr(slash + 1));
    in_addr address{};
    if (!bits || *bits < min_prefix || *bits > 32 ||
        inet_pton(AF_INET, text.substr(0, slash).c_str(), &address) != 1) {
        return "invalid network '" + text + "'; write 10.10.10.0/24, with 24..32 bits";
    }
    const std::uint32_t size = 1U << (32 - *bits);
    const std::uint32_t first = ntohl(address.s_addr) & ~(size - 1);
    // of more than two addresses, the first is the network's own and the last that of broadcasts
    const std::uint32_t reserved = size > 2 ? 1 : 0;
    for (std::uint32_t n = reserved; n < size - reserved; ++n) {
        char host[INET_ADDRSTRLEN] = {};
        const in_addr one{htonl(first + n)};
        inet_ntop(AF_INET, &one, host, sizeof host);
        hosts.emplace_back(host);
    }
    return {};
}

struct Asked {
    std::string host;
    std::unique_ptr<datagram::Port> port;
};

/// Asks all hosts for their cookie, 2 ms apart, and returns those that have answered with it.
std::vector<std::string> hosts_with_cards(const std::vector<std::string>& hosts,
                                          std::int64_t timeout_ns, const StopRequest& stop) {
    Request request;
    request.read(Space::hostmot2, cookie_address, Unit::u32);
    std::vector<Asked> asked;
    for (const std::string& host : hosts) {
        if (stop.requested()) break;
        auto opened = datagram::open("eth:" + host, {.port = udp_port, .spin_ns = 0});
        if (!opened) continue;
        opened.port->send(request.bytes(), datagram::unclocked);
        asked.push_back({host, std::move(opened.port)});
        if (hosts.size() > 1) {
            const timespec pause = link::to_timespec(2'000'000);
            nanosleep(&pause, nullptr);
        }
    }
    std::vector<std::string> found;
    const std::int64_t limit_ns = link::monotonic_ns() + timeout_ns;
    for (const Asked& one : asked) {
        one.port->wait(std::max<std::int64_t>(0, limit_ns - link::monotonic_ns()));
        std::array<std::uint8_t, datagram::max_size> reply;
        const std::size_t size = one.port->receive(reply, datagram::unclocked);
        if (size == 4 && load<std::uint32_t>(reply.data()) == hostmot2_cookie) {
            found.push_back(one.host);
        }
    }
    return found;
}

std::string clock_text(std::uint32_t hz) { return fmt::format("{:g} MHz", hz / 1e6); }

std::string info_text(const std::string& host, const CardIdentity& card) {
    const Board* const board = board_of(card.name);
    std::string text = fmt::format(
        "{} at {}, MAC {}\nLBP16 version {}, firmware version {}\nIDROM type {} at 0x{:04X}: {}, "
        "{} ports of {} pins, clocks {} and {}\n",
        card.name, host, mac_text(card.mac), card.lbp_version, card.firmware_version,
        card.idrom.type, card.idrom_address, card.board, card.idrom.ports, card.idrom.port_width,
        clock_text(card.idrom.clock_low_hz), clock_text(card.idrom.clock_high_hz));
    text +=
        fmt::format("received packets {}, errors {}\n", card.received_packets, card.parse_errors);
    if (board == nullptr) {
        text += "unknown card: hm2_eth has no names for its pins\n";
    } else {
        text += fmt::format("pins begin with hm2_{}.0.\n", board->name);
    }
    text += fmt::format("\n{:22}  {:>5}  {:>7}  {:>9}  {:>6}  {}\n", "module", "count", "version",
                        "registers", "base", "remark");
    for (const ModuleDescriptor& module : card.modules) {
        const ModuleKind* const kind = kind_of(module.tag);
        std::string remark;
        const std::string_view known_name = name_of(module.tag);
        if (known_name == "?") {
            remark = "unknown";
        } else if (kind == nullptr) {
            remark = "not supported";
        } else if (fault_of(module, *kind, card.idrom) != ModuleFault::none) {
            remark = "not as drivers know it";
        }
        const std::string name = known_name == "?"
                                     ? fmt::format("0x{:02X}", static_cast<unsigned>(module.tag))
                                     : std::string(known_name);
        std::string line =
            fmt::format("{:22}  {:>5}  {:>7}  {:>9}  0x{:04X}  {}", name, module.instances,
                        module.version, module.registers, module.base, remark);
        line.erase(line.find_last_not_of(' ') + 1);
        text += line + "\n";
    }
    return text;
}

std::string info_json(const std::string& host, const CardIdentity& card) {
    std::string text = fmt::format(
        R"({{"host":{},"name":{},"mac":"{}","lbp_version":{},"firmware_version":{},"board":{},"idrom_type":{},"ports":{},"port_width":{},"clock_low_hz":{},"clock_high_hz":{},"received_packets":{},"modules":[)",
        json_text(host), json_text(card.name), mac_text(card.mac), card.lbp_version,
        card.firmware_version, json_text(card.board), card.idrom.type, card.idrom.ports,
        card.idrom.port_width, card.idrom.clock_low_hz, card.idrom.clock_high_hz,
        card.received_packets);
    const char* separator = "\n ";
    for (const ModuleDescriptor& module : card.modules) {
        text += fmt::format(
            R"({}{{"tag":{},"name":{},"version":{},"count":{},"base":{},"registers":{}}})",
            separator, static_cast<unsigned>(module.tag), json_text(name_of(module.tag)),
            module.version, module.instances, module.base, module.registers);
        separator = ",\n ";
    }
    return text + "]}\n";
}

std::string pins_text(const CardIdentity& card) {
    std::string text = fmt::format("{:>4}  {:>4}  {:>3}  {:9}  {}\n", "gpio", "port", "bit",
                                   "direction", "module");
    for (std::size_t n = 0; n < card.pins.size(); ++n) {
        const PinDescriptor& pin = card.pins[n];
        const char* direction = pin.is_output ? "output" : "input";
        std::string line = fmt::format("{:>4}  {:>4}  {:>3}  {:9}  {}", n,
                                       n / card.idrom.port_width, n % card.idrom.port_width,
                                       pin.module == Tag::none ? "" : direction, function_of(pin));
        line.erase(line.find_last_not_of(' ') + 1);
        text += line + "\n";
    }
    return text;
}

std::string pins_json(const CardIdentity& card) {
    std::string text = "[";
    const char* separator = "\n ";
    for (std::size_t n = 0; n < card.pins.size(); ++n) {
        const PinDescriptor& pin = card.pins[n];
        text += fmt::format(R"({}{{"gpio":{},"port":{},"bit":{},"output":{},"module":{}}})",
                            separator, n, n / card.idrom.port_width, n % card.idrom.port_width,
                            pin.is_output, json_text(function_of(pin)));
        separator = ",\n ";
    }
    return text + "]\n";
}

/// Reads a card. Returns false after a message.
bool read_card(const MesaCardOptions& options, CardIdentity& identity) {
    CardClient card;
    std::string problem = card.open(options.words[0], options.timeout_ns);
    if (problem.empty()) {
        problem = read_identity(card, identity);
    }
    if (problem.empty()) return true;
    fail(options, problem);
    return false;
}

}  // namespace

/// Returns the hosts, or how many there are.
static std::string hosts_text(const std::vector<std::string>& hosts) {
    constexpr std::size_t few = 4;
    if (hosts.size() > few) return fmt::format("{} addresses", hosts.size());
    return fmt::format("{}", fmt::join(hosts, " or "));
}

int run_mesa_scan(const MesaScanOptions& options) {
    std::vector<std::string> hosts;
    for (const std::string& word : options.words) {
        if (const std::string problem = add_hosts(word, hosts); !problem.empty()) {
            return fail(options, problem);
        }
    }
    if (hosts.empty()) {
        hosts.assign(std::begin(usual_addresses), std::end(usual_addresses));
    }
    StopRequest stop;
    const auto found = hosts_with_cards(hosts, options.timeout_ns, stop);
    for (const std::string& host : found) {
        CardClient card;
        CardIdentity identity;
        std::string problem = card.open(host, options.timeout_ns);
        if (problem.empty()) {
            problem = read_name(card, identity);
        }
        const std::string what =
            problem.empty() ? identity.name + ", MAC " + mac_text(identity.mac) : problem;
        if (!print(fmt::format("{}  {}\n", host, what))) return 1;
    }
    if (!found.empty()) return 0;
    return fail(options, fmt::format("no card answers at {}; an interface of this computer needs "
                                     "an address in the subnet of the card",
                                     hosts_text(hosts)));
}

int run_mesa_info(const MesaCardOptions& options) {
    CardIdentity identity;
    if (!read_card(options, identity)) return 1;
    return exit_code(print(options.json ? info_json(options.words[0], identity)
                                        : info_text(options.words[0], identity)));
}

int run_mesa_pins(const MesaCardOptions& options) {
    CardIdentity identity;
    if (!read_card(options, identity)) return 1;
    return exit_code(print(options.json ? pins_json(identity) : pins_text(identity)));
}

}  // namespace hal::tools
