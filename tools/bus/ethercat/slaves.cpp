// SPDX-License-Identifier: MIT
// `hal ethercat scan`, `slaves` and `states`: what is on the bus.
#include <fmt/core.h>

#include "bus/ethercat/session.hpp"
#include "cli/output.hpp"
#include "commands/json_text.hpp"
#include "ethercat/wire/al_status_codes.hpp"

namespace hal::tools {

namespace {

using ethercat::master::BusSlave;

std::string quoted(std::string_view text) {
    std::string out;
    json_quote(out, text);
    return out;
}

/// Returns the name in the SII, or the identity if there is none.
std::string name_of(EthercatSession& session, const BusSlave& s) {
    if (const auto bytes = session.sii(s)) {
        const auto contents = ethercat::sii::parse(*bytes);
        if (!contents.general.name.empty()) return contents.general.name;
    }
    return fmt::format("0x{:08X}:0x{:08X}", s.vendor, s.product);
}

std::string state_of(const BusSlave& s) { return fmt::format("{}{}", ethercat::to_string(s.state), s.al_failed ? " + error" : ""); }

std::string error_of(const BusSlave& s) {
    if (!s.al_failed) return {};
    const auto* row = ethercat::al_status(s.al_code);
    if (row == nullptr) return fmt::format("AL status code 0x{:04X}; see the manual of the device", s.al_code);
    return fmt::format("AL status code 0x{:04X} ({}): {}; {}", s.al_code, row->text, row->cause, row->remedy);
}

/// Prints a line per slave by `line`, or JSON by `member`.
template <class Line, class Member>
int list(const EthercatOptions& options, Line line, Member member) {
    EthercatSession session;
    if (!session.open(options)) return 1;
    if (!session.arguments().empty()) return fail(options, fmt::format("unexpected argument '{}'", session.arguments().front()));
    std::string text;
    for (std::size_t n = 0; n < session.size(); ++n) {
        const BusSlave& s = session.slave(n);
        if (options.json)
            text += fmt::format("{}{{\"position\":{},\"state\":{},\"error\":{}{}}}", n == 0 ? "[" : ",\n ", n, quoted(ethercat::to_string(s.state)),
                                s.al_failed ? quoted(error_of(s)) : "null", member(session, s));
        else text += line(session, s) + "\n";
    }
    return print(text + (options.json ? "]\n" : "")) ? 0 : 1;
}

}  // namespace

int run_ethercat_scan(const EthercatOptions& options) {
    const auto depth = [](EthercatSession& session, const BusSlave& s) {
        std::size_t count = 0;
        for (int parent = s.parent; parent >= 0 && count < session.size(); parent = session.slave(static_cast<std::size_t>(parent)).parent) ++count;
        return count;
    };
    return list(options, [&](EthercatSession& session, const BusSlave& s) {
        std::string text = fmt::format("{}{}  {}  {}", std::string(2 * depth(session, s), ' '), s.position, state_of(s), name_of(session, s));
        if (s.parent >= 0) text += fmt::format("  at port {} of slave {}", s.parent_port, s.parent);
        text += s.has_dc() ? fmt::format("  delay {} ns", s.delay_ns) : "  no clock";
        for (unsigned port = 0; port < 4; ++port)
            if (s.neighbour[port] >= 0 && s.neighbour[port] != s.parent) text += fmt::format("  port {}: slave {}", port, s.neighbour[port]);
        return text;
    }, [](EthercatSession& session, const BusSlave& s) {
        const std::string parent = s.parent >= 0 ? fmt::format("{},\"parent_port\":{}", s.parent, s.parent_port) : "null,\"parent_port\":null";
        return fmt::format(R"(,"name":{},"parent":{},"delay_ns":{})", quoted(name_of(session, s)), parent, s.has_dc() ? fmt::format("{}", s.delay_ns) : "null");
    });
}

int run_ethercat_slaves(const EthercatOptions& options) {
    return list(options, [](EthercatSession& session, const BusSlave& s) {
        return fmt::format("{:<4} {:>5}:{:<3} {:<8} {} {}", s.position, s.alias, 0, ethercat::to_string(s.state), s.al_failed ? "E" : "+", name_of(session, s));
    }, [](EthercatSession& session, const BusSlave& s) {
        return fmt::format(R"(,"alias":{},"vendor":{},"product":{},"revision":{},"serial":{},"name":{})", s.alias, s.vendor, s.product, s.revision,
                           s.serial, quoted(name_of(session, s)));
    });
}

int run_ethercat_states(const EthercatOptions& options) {
    return list(options, [](EthercatSession&, const BusSlave& s) {
        return fmt::format("{:<4} {}{}{}", s.position, ethercat::to_string(s.state), s.al_failed ? "  " : "", error_of(s));
    }, [](EthercatSession&, const BusSlave&) { return std::string(); });
}

}  // namespace hal::tools
