// SPDX-License-Identifier: MIT
// `hal ethercat scan`, `slaves`, `states` and `crc`: what is on the bus.
#include <algorithm>
#include <cctype>
#include <cstdlib>

#include "bus/ethercat/wire.hpp"
#include "bus/ethercat/words.hpp"
#include "cli/output.hpp"
#include "ethercat/wire/al_status_codes.hpp"
#include "ethercat/wire/registers.hpp"

namespace hal::tools {

namespace {

using ethercat::State;
using ethercat::master::BusSlave;
namespace reg = ethercat::registers;

std::string error_of(const BusSlave& s) {
    if (!s.al_failed) {
        return {};
    }
    const auto* row = ethercat::al_status(s.al_code);
    if (row == nullptr) {
        return fmt::format("AL status code 0x{:04X}; see the manual of the device", s.al_code);
    }
    return fmt::format("AL status code 0x{:04X} ({}): {}; {}", s.al_code, row->text, row->cause,
                       row->remedy);
}

/// Prints a line per slave by `line`, or JSON by `member`.
template <class Line, class Member>
int list(const EthercatOptions& options, EthercatWire& wire, Line line, Member member) {
    std::string text;
    for (std::size_t n = 0; n < wire.size(); ++n) {
        const BusSlave& s = wire.slave(n);
        if (options.json) {
            text += fmt::format("{}{{\"position\":{},\"state\":{},\"error\":{}{}}}",
                                n == 0 ? "[" : ",\n ", n, json_string(ethercat::to_string(s.state)),
                                s.al_failed ? json_string(error_of(s)) : "null", member(s));
        } else {
            text += line(s) + "\n";
        }
    }
    if (options.json) {
        text += "]\n";
    }
    return print(text) ? 0 : 1;
}

std::string state_column(const BusSlave& s) {
    return fmt::format("{:<4} {}{}{}", s.position, ethercat::to_string(s.state),
                       s.al_failed ? "  " : "", error_of(s));
}

std::optional<State> state_named(const std::string& text) {
    std::string plain;
    for (const char c : text) {
        if (c != '-') {
            plain += static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
        }
    }
    constexpr std::pair<const char*, State> names[] = {{"INIT", State::init},
                                                       {"PREOP", State::preop},
                                                       {"BOOT", State::boot},
                                                       {"SAFEOP", State::safeop},
                                                       {"OP", State::op}};
    for (const auto& [name, state] : names) {
        if (plain == name) return state;
    }
    return std::nullopt;
}

bool set_sync_manager(EthercatWire& wire, const BusSlave& s, unsigned number, std::uint16_t start,
                      std::size_t length, std::uint8_t control) {
    const auto bytes = static_cast<std::uint16_t>(length);
    const std::uint8_t values[8] = {static_cast<std::uint8_t>(start),
                                    static_cast<std::uint8_t>(start >> 8),
                                    static_cast<std::uint8_t>(bytes),
                                    static_cast<std::uint8_t>(bytes >> 8),
                                    control,
                                    0,
                                    static_cast<std::uint8_t>(bytes != 0 ? 1 : 0),
                                    0};
    return wire.write(s.position, reg::sync_manager_at(number), values);
}

/// Sets the sync managers that the next state needs, as the SII has them.
void prepare(EthercatWire& wire, const BusSlave& s, State next) {
    const auto& c = wire.contents(s.position);
    if (next == State::preop || next == State::boot) {
        const auto& areas = next == State::boot ? c.boot : c.mailboxes;
        if (areas.receive.size == 0 || areas.send.size == 0) return;
        set_sync_manager(wire, s, 0, areas.receive.start, areas.receive.size, 0x26);
        set_sync_manager(wire, s, 1, areas.send.start, areas.send.size, 0x22);
    } else if (next == State::safeop) {
        for (unsigned n = 0; n < c.sync_managers.size(); ++n) {
            const auto& sm = c.sync_managers[n];
            if (sm.type != ethercat::sii::SmType::outputs &&
                sm.type != ethercat::sii::SmType::inputs) {
                continue;
            }
            std::size_t bits = 0;
            for (const auto* pdos : {&c.tx, &c.rx}) {
                for (const auto& pdo : *pdos) {
                    for (const auto& entry : pdo.entries) {
                        bits += pdo.sync_manager == n ? entry.bits : 0U;
                    }
                }
            }
            set_sync_manager(wire, s, n, sm.start, (bits + 7) / 8, sm.control);
        }
    }
}

/// Requests a state and waits for it. Returns whether it was reached.
bool request(EthercatWire& wire, BusSlave& s, State state) {
    constexpr std::int64_t timeout_ns = 10'000'000'000;
    prepare(wire, s, state);
    if (!wire.write(s.position, reg::al_control, static_cast<std::uint16_t>(state))) return false;
    for (const std::int64_t until = wire.now_ns() + timeout_ns; wire.now_ns() < until;
         wire.pass(1'000'000)) {
        wire.read_state(s);
        if (s.state == state && !s.al_failed) return true;
        if (s.al_failed || s.state == State::none) return false;
    }
    return false;
}

/// Returns the states that lead from one to another: up step by step, down at once. BOOT is entered
/// and left by INIT.
std::vector<State> steps_to(State from, State target) {
    std::vector<State> steps;
    const bool by_init = target == State::boot || from == State::boot || from == State::none;
    if (by_init || target == State::init) {
        steps.push_back(State::init);
        from = State::init;
    }
    if (target == State::boot || target < from) {
        steps.push_back(target);
    }
    for (const State step : {State::preop, State::safeop, State::op}) {
        if (target != State::boot && step > from && step <= target) {
            steps.push_back(step);
        }
    }
    return steps.empty() ? std::vector{target} : steps;
}

/// Brings a slave to a state step by step; returns the state that it did not reach.
std::optional<State> bring(EthercatWire& wire, BusSlave& s, State target) {
    if (s.al_failed) {
        wire.write(s.position, reg::al_control,
                   static_cast<std::uint16_t>(static_cast<unsigned>(s.state) | ethercat::al_error));
        wire.read_state(s);
    }
    if (s.state == target && !s.al_failed) return std::nullopt;
    for (const State step : steps_to(s.state, target)) {
        if (!request(wire, s, step)) return step;
    }
    return std::nullopt;
}

}  // namespace

int run_ethercat_scan(const EthercatOptions& options) {
    EthercatWire wire;
    if (!wire.open(options) || !wire.without_arguments(options)) return 1;
    wire.identify();
    const auto depth = [&](const BusSlave& s) {
        std::size_t count = 0;
        for (int at = s.parent; at >= 0 && count < wire.size();
             at = wire.slave(static_cast<std::size_t>(at)).parent) {
            ++count;
        }
        return count;
    };
    return list(options, wire, [&](const BusSlave& s) {
        std::string text = fmt::format("{}{}  {}{}  {}", std::string(2 * depth(s), ' '), s.position,
                                       ethercat::to_string(s.state), s.al_failed ? " + error" : "",
                                       wire.name(s.position));
        if (s.parent >= 0) {
            text += fmt::format("  at port {} of slave {}", s.parent_port, s.parent);
        }
        return text + (s.has_dc() ? fmt::format("  delay {} ns", s.delay_ns) : "  no clock");
    }, [&](const BusSlave& s) {
        const std::string parent =
            s.parent >= 0 ? fmt::format("{},\"parent_port\":{}", s.parent, s.parent_port)
                          : "null,\"parent_port\":null";
        return fmt::format(R"(,"name":{},"parent":{},"delay_ns":{})",
                           json_string(wire.name(s.position)), parent,
                           s.has_dc() ? fmt::format("{}", s.delay_ns) : "null");
    });
}

int run_ethercat_slaves(const EthercatOptions& options) {
    EthercatWire wire;
    if (!wire.open(options) || !wire.without_arguments(options)) return 1;
    wire.identify();
    // the newest alias along the line, and how far behind it a slave is
    unsigned alias = 0;
    unsigned behind = 0;
    return list(options, wire, [&](const BusSlave& s) {
        if (s.alias != 0) {
            alias = s.alias;
            behind = 0;
        } else if (s.position != 0) {
            ++behind;
        }
        return fmt::format("{:<4} {:>5}:{:<3} {:<8} {} {}", s.position, alias, behind,
                           ethercat::to_string(s.state), s.al_failed ? "E" : "+",
                           wire.name(s.position));
    }, [&](const BusSlave& s) {
        return fmt::format(
            R"(,"alias":{},"vendor":{},"product":{},"revision":{},"serial":{},"name":{})", s.alias,
            s.vendor, s.product, s.revision, s.serial, json_string(wire.name(s.position)));
    });
}

/// `hal ethercat states`: prints the states of the slaves; with a state, brings one or all to it
/// before.
int run_ethercat_states(const EthercatPositionOptions& options) {
    const std::size_t address_words = options.emulate.empty() ? 1 : 0;
    if (options.words.size() > address_words + 1) {
        return fail(options,
                    fmt::format("unexpected argument '{}'", options.words[address_words + 1]));
    }
    std::optional<State> target;
    if (options.words.size() == address_words + 1) {
        target = state_named(options.words.back());
        if (!target) {
            return fail(options,
                        fmt::format("unknown state '{}'; write INIT, PREOP, BOOT, SAFEOP or OP",
                                    options.words.back()));
        }
    }
    EthercatWire wire;
    if (!wire.open(options, target.has_value())) return 1;
    if (options.position >= 0 && wire.chosen(options) == nullptr) return 1;
    if (target && options.position < 0) {
        wire.identify();
    }
    int code = 0;
    for (std::size_t n = 0; target && n < wire.size(); ++n) {
        if (options.position >= 0 && n != static_cast<std::size_t>(options.position)) continue;
        BusSlave& s = wire.slave(n);
        if (const auto missed = bring(wire, s, *target)) {
            code = fail(
                options,
                fmt::format("slave {}: {} not reached, it is in {}: {}", n,
                            ethercat::to_string(*missed), ethercat::to_string(s.state),
                            s.al_failed ? error_of(s) : "no answer to the request within 10 s"));
        }
    }
    const int printed =
        list(options, wire, state_column, [](const BusSlave&) { return std::string(); });
    return code != 0 ? code : printed;
}

namespace {

/// The error counters of a port.
struct PortErrors {
    unsigned invalid, receive, forwarded, lost;
    /// Returns whether the cable of this port is a cause; forwarded errors happened before.
    bool are_own() const { return invalid + receive + lost != 0; }
    bool any() const { return are_own() || forwarded != 0; }
};

/// Returns what is at the other end of the cable of a port: "slave 2 port 0", "the master".
std::string far_end(EthercatWire& wire, std::size_t n, unsigned port) {
    const BusSlave& s = wire.slave(n);
    const int other = s.neighbour[port];
    if (other < 0) {
        return n == 0 && port == s.entry_port ? "the master" : "nothing (open now)";
    }
    const BusSlave& peer = wire.slave(static_cast<std::size_t>(other));
    unsigned at = 0;
    while (at < 3 && peer.neighbour[at] != static_cast<int>(n)) {
        ++at;
    }
    return fmt::format("slave {} port {}", other, at);
}

/// The counters of all ports, for both forms of output.
struct PortReport {
    std::string text = "slave port  invalid  receive  forwarded  link losses\n";
    std::string rows, cables;  ///< JSON

    void add(EthercatWire& wire, std::size_t n, unsigned port, const PortErrors& e) {
        text += fmt::format("{:>5} {:>4} {:>8} {:>8} {:>10} {:>12}\n", n, port, e.invalid,
                            e.receive, e.forwarded, e.lost);
        rows += fmt::format(
            "{}{{\"position\":{},\"port\":{},\"invalid\":{},\"receive\":{},\"forwarded\":{},"
            "\"link_losses\":{}}}",
            rows.empty() ? "" : ",\n ", n, port, e.invalid, e.receive, e.forwarded, e.lost);
        if (!e.are_own()) return;
        const std::string cable = fmt::format("check the cable between slave {} port {} and {}", n,
                                              port, far_end(wire, n, port));
        text += "      " + cable + "\n";
        cables += (cables.empty() ? "" : ",") + json_string(cable);
    }
};

}  // namespace

/// `hal ethercat crc`: prints the error counters of the ports, and between which ports a cable
/// causes errors.
int run_ethercat_crc(const EthercatOptions& options) {
    EthercatWire wire;
    if (!wire.open(options) || !wire.without_arguments(options)) return 1;
    PortReport report;
    for (std::size_t n = 0; n < wire.size(); ++n) {
        const BusSlave& s = wire.slave(n);
        auto all = wire.read(n, reg::rx_errors, 20);
        if (!all && !(all = wire.read(n, reg::rx_errors, 8))) {
            return fail(options,
                        fmt::format("slave {} no longer responds; check its supply and cable", n));
        }
        all->resize(20);  // counters that the controller does not have are 0
        for (unsigned port = 0; port < 4; ++port) {
            const PortErrors errors{(*all)[2 * port], (*all)[2 * port + 1], (*all)[8 + port],
                                    (*all)[16 + port]};
            const bool used = port == s.entry_port || s.neighbour[port] >= 0;
            if (used || errors.any()) {
                report.add(wire, n, port, errors);
            }
        }
    }
    if (options.json) {
        return print(
                   fmt::format("{{\"ports\":[{}],\"cables\":[{}]}}\n", report.rows, report.cables))
                   ? 0
                   : 1;
    }
    if (report.cables.empty()) {
        report.text += "no port has counted errors of its own\n";
    }
    return print(report.text) ? 0 : 1;
}

}  // namespace hal::tools
