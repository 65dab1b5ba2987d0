// SPDX-License-Identifier: MIT
// `hal can lss`: configures node ID and bit rate of nodes by LSS (CiA 305).
#include "bus/canopen/lss.hpp"

#include <fmt/core.h>

#include "base/types.hpp"
#include "bus/canopen/node_client.hpp"
#include "cli/output.hpp"
#include "text/diagnostic.hpp"
#include "text/numbers.hpp"

namespace hal::tools {

using canopen::Identity;
using canopen::LssMaster;

namespace {

struct Lss {
    const Options& options;
    NodeClient& station;
    std::vector<std::string> arguments;

    bool wait() const {
        station.until([&] { return !station.lss.busy(); });
        return station.lss.result().answered;
    }
    void sent() const {
        station.until([&] { return station.out.size() == 0; }, 1'000'000'000);
    }
    int silent(const char* help) const {
        if (station.bus.stop.requested()) {
            return fail(options, "interrupted before a response arrived");
        }
        return fail(options, fmt::format("no slave responded; {}", help));
    }
    /// Finishes a configuration service and reports its error byte.
    int configured(const char* out_of_range) const {
        if (!wait()) {
            return silent(
                "one slave must be in the configuration state: see switch and select in: hal help "
                "can lss");
        }
        const LssMaster::Result& r = station.lss.result();
        switch (r.error) {
        case 0: return 0;
        case 1:
            return fail(options, fmt::format("the slave rejected the request: {}", out_of_range));
        case 255:
            return fail(options, fmt::format("the slave rejected the request with its specific "
                                             "error 0x{:02X}; see its manual",
                                             r.specific));
        default:
            return fail(options, fmt::format("the slave rejected the request with error {}: cannot "
                                             "access its memory; see its manual",
                                             r.error));
        }
    }
    bool number(std::size_t n, const char* what, std::uint64_t max, std::uint32_t& value) const {
        const std::string& text = arguments[n];
        const std::optional<std::uint64_t> read = parse_natural(text);
        if (read && *read <= max) {
            value = static_cast<std::uint32_t>(*read);
            return true;
        }
        fail(options,
             fmt::format("invalid {1} '{0}'; write a number up to {2}, or 0x…", text, what, max));

        return false;
    }
    bool identity(std::size_t from, Identity& out) const {
        constexpr const char* parts[] = {"vendor ID", "product code", "revision number",
                                         "serial number"};
        for (std::size_t n = 0; n < 4; ++n) {
            if (!number(from + n, parts[n], UINT32_MAX, out[n])) return false;
        }
        return true;
    }
};

std::string text_of(const Identity& id, const char* state) {
    return fmt::format("vendor 0x{:08X}, product 0x{:08X}, revision 0x{:08X}, serial 0x{:08X}{}\n",
                       id[0], id[1], id[2], id[3], state);
}

int switch_all(Lss& l) {
    const bool configuration = l.arguments[0] == "configuration";
    if (!configuration && l.arguments[0] != "waiting") {
        return fail(l.options, fmt::format("invalid state '{}'; write configuration or waiting",
                                           l.arguments[0]));
    }
    l.station.lss.switch_global(configuration);
    l.sent();
    return 0;
}

int select(Lss& l) {
    Identity id{};
    if (!l.identity(0, id)) return 1;
    l.station.lss.select(id, monotonic_ns());
    return l.wait() ? 0
                    : l.silent(
                          "check the four numbers vendor, product, revision and serial on the "
                          "label of the device or with hal can scan");
}

int inquire(Lss& l) {
    Identity id{};
    for (unsigned part = 0; part < 5; ++part) {
        l.station.lss.inquire(part, monotonic_ns());
        if (!l.wait()) {
            return l.silent(
                "one slave must be in the configuration state: see switch and select in: hal help "
                "can lss");
        }
        if (part < 4) {
            id[part] = l.station.lss.result().value;
        }
    }
    const std::uint32_t node = l.station.lss.result().value;
    return print(text_of(id, node == canopen::unconfigured
                                 ? ", no node ID"
                                 : fmt::format(", node ID {}", node).c_str()))
               ? 0
               : 1;
}

int node_id(Lss& l) {
    std::uint32_t id = canopen::unconfigured;
    if (l.arguments[0] != "none" && (!l.number(0, "node ID", 255, id) ||
                                     (id != canopen::unconfigured && (id < 1 || id > 127)))) {
        return id > 127 ? fail(l.options, fmt::format("invalid node ID '{}'; write 1..127, or none",
                                                      l.arguments[0]))
                        : 1;
    }
    l.station.lss.configure_node_id(static_cast<std::uint8_t>(id), monotonic_ns());
    return l.configured("node ID out of range");
}

int bit_rate(Lss& l) {
    std::string text = l.arguments[0];
    std::uint32_t scale = 1;
    std::uint32_t rate = 0;
    if (text.ends_with("k")) {
        scale = 1000;
        text.pop_back();
    } else if (text.ends_with("M")) {
        scale = 1'000'000;
        text.pop_back();
    }
    const std::uint8_t index = parse_whole(text, rate) && rate <= 1'000'000 / scale
                                   ? canopen::lss_bit_rate_index(rate * scale)
                                   : std::uint8_t{255};
    if (index == 255) {
        return fail(
            l.options,
            fmt::format("invalid bit rate '{}'; write 1M, 800k, 500k, 250k, 125k, 50k, 20k or 10k",
                        l.arguments[0]));
    }
    l.station.lss.configure_bit_timing(index, monotonic_ns());
    return l.configured("unsupported bit rate");
}

int activate(Lss& l) {
    const auto ns = parse_duration_ns(l.arguments[0]);
    if (!ns || *ns < 0 || *ns > 65'535'000'000) {
        return fail(
            l.options,
            fmt::format(
                "invalid delay '{}'; write the pause before and after the switch: 1s, 500ms",
                l.arguments[0]));
    }
    l.station.lss.activate_bit_timing(static_cast<std::uint16_t>(*ns / 1'000'000));
    l.sent();
    return 0;
}

int store(Lss& l) {
    l.station.lss.store_configuration(monotonic_ns());
    return l.configured("storing is unsupported");
}

int fastscan(Lss& l) {
    l.station.lss.scan(monotonic_ns());
    if (!l.wait()) return l.silent("a scan finds unconfigured slaves in the waiting state only");
    const Identity& found = l.station.lss.result().identity;
    return exit_code(print(text_of(found, ", now in the configuration state")));
}

int identify(Lss& l) {
    if (l.arguments.empty()) {
        l.station.lss.identify_unconfigured(monotonic_ns());
        if (!l.wait()) return l.silent("no unconfigured slave that supports LSS");
        return exit_code(print("at least one unconfigured slave\n"));
    }
    Identity low{};
    Identity high{};
    std::uint32_t revision = 0;
    std::uint32_t serial = 0;
    if (l.arguments.size() != 4 && l.arguments.size() != 6) {
        return fail(l.options,
                    "identify takes no arguments, VENDOR PRODUCT REVISION SERIAL, or ranges: "
                    "VENDOR PRODUCT FROM TO FROM TO");
    }
    if (l.arguments.size() == 4) {
        if (!l.identity(0, low)) return 1;
        high = low;
    } else {
        if (!l.number(0, "vendor ID", UINT32_MAX, low[0]) ||
            !l.number(1, "product code", UINT32_MAX, low[1]) ||
            !l.number(2, "revision number", UINT32_MAX, low[2]) ||
            !l.number(3, "revision number", UINT32_MAX, revision) ||
            !l.number(4, "serial number", UINT32_MAX, low[3]) ||
            !l.number(5, "serial number", UINT32_MAX, serial)) {
            return 1;
        }
        high = {low[0], low[1], revision, serial};
    }
    l.station.lss.identify(low, high, monotonic_ns());
    if (!l.wait()) return l.silent("no slave of this identity that supports LSS");
    return exit_code(print("slave identified\n"));
}

struct Command {
    const char* name;
    const char* arguments;
    std::size_t min, max;
    int (*run)(Lss&);
};

constexpr Command commands[] = {
    {"scan", "", 0, 0, fastscan},
    {"switch", " configuration|waiting", 1, 1, switch_all},
    {"select", " VENDOR PRODUCT REVISION SERIAL", 4, 4, select},
    {"inquire", "", 0, 0, inquire},
    {"node-id", " NODE|none", 1, 1, node_id},
    {"bit-rate", " RATE", 1, 1, bit_rate},
    {"activate", " DELAY", 1, 1, activate},
    {"store", "", 0, 0, store},
    {"identify", " [VENDOR PRODUCT REVISION SERIAL]", 0, 6, identify},
};

}  // namespace

int run_can_lss(const LssOptions& options) {
    if (options.words.size() < 2) {
        return fail(options,
                    "expected ADDRESS COMMAND; type: hal can lss ADDRESS "
                    "scan|switch|select|inquire|node-id|bit-rate|activate|store|identify");
    }
    const std::string& word = options.words[1];
    const Command* command = nullptr;
    std::vector<std::string> names;
    for (const Command& c : commands) {
        names.emplace_back(c.name);
        if (word == c.name) {
            command = &c;
        }
    }
    if (!command) {
        const std::string hint = did_you_mean(word, names);
        return fail(options, fmt::format("unknown command '{}'; {}", word,
                                         hint.empty() ? "see: hal help can lss" : hint));
    }
    std::vector<std::string> arguments(options.words.begin() + 2, options.words.end());
    if (arguments.size() < command->min || arguments.size() > command->max) {
        return fail(options, fmt::format("wrong arguments of {}; type: hal can lss ADDRESS {}{}",
                                         word, word, command->arguments));
    }
    NodeClient station(options, options.timeout_ns);
    if (!station.open(options.words[0])) return 1;
    Lss lss{options, station, std::move(arguments)};
    return command->run(lss);
}

}  // namespace hal::tools
