// SPDX-License-Identifier: MIT
// `hal can scan`: finds CANopen nodes. All 127 are queried at once for type and identity while heartbeats are received.
#include "bus/can/scan.hpp"

#include <fmt/core.h>
#include <map>
#include <optional>
#include <unistd.h>

#include "bus/can/bus.hpp"
#include "bus/can/frame_decoder.hpp"
#include "bus/can/sdo.hpp"
#include "canopen/protocol/numbers.hpp"
#include "cli/output.hpp"

namespace hal::tools {

namespace {

struct Node {
    std::optional<canopen::NmtState> state;
    std::optional<std::uint32_t> type, identity[4];
    std::string refused;  ///< abort of the read of its type
    unsigned unasked = 0;
    bool booted = false;
};

std::string cell(const std::optional<std::uint32_t>& value) {
    return value ? fmt::format("0x{:08X}", *value) : "-";
}
std::string member(const std::optional<std::uint32_t>& value) {
    return value ? fmt::format("{}", *value) : "null";
}

std::string remark(const Node& n) {
    if (n.unasked > 1) return "more than one response: possible duplicate node ID";
    if (!n.refused.empty()) return "cannot read its type: " + n.refused;
    if (!n.type) return "no response to SDO requests";
    return profile_name(*n.type);
}

}  // namespace

int run_can_scan(const ScanOptions& options) {
    if (options.words.size() != 1) {
        return fail(options, fmt::format("nothing is expected at '{}'; see: hal help can scan",
                                         options.words[1]));
    }
    Bus bus;
    if (!bus.open(options, options.words[0], false)) return 1;
    std::map<unsigned, Node> nodes;
    ParallelReads reads;
    std::uint64_t heard = 0;
    for (std::uint8_t node = 1; node <= 127; ++node) {
        reads.ask(node, 0x1000, 0);
    }
    reads.on_answer = [&](const ParallelReads::Answer& a) {
        Node& n = nodes[a.node];
        if (!a.asked) {
            ++n.unasked;
        } else if (a.index == 0x1000) {
            if (a.abort == 0) {
                n.type = a.value;
            } else {
                n.refused = canopen::to_string(static_cast<canopen::Abort>(a.abort));
            }
            for (std::uint8_t sub = 1; sub <= 4; ++sub) {
                reads.ask(a.node, 0x1018, sub);
            }
        } else if (a.abort == 0) {
            n.identity[a.sub - 1] = a.value;
        }
    };
    const std::int64_t for_ns = options.for_ns >= 0 ? options.for_ns : 1'000'000'000;
    listen(bus, for_ns, [&](std::span<const can::Frame> batch) {
        for (const can::Frame& f : batch) {
            heard += !f.own && !f.error;
            reads.handle(f);
            if (f.own || f.error || f.extended || f.remote || f.length != 1 || f.id <= 0x700 ||
                f.id > 0x77f) {
                continue;
            }
            Node& n = nodes[f.id & 0x7f];
            n.state = static_cast<canopen::NmtState>(f.data[0] & 0x7f);
            n.booted = n.booted || f.data[0] == 0;
        }
        return true;
    }, 1'000'000, [&] { reads.poll(*bus.link, 8); });
    const can::Statistics s = bus.link->statistics();
    if (nodes.empty()) {
        return fail(options,
                    fmt::format("no node responded within {:g} s; the bus is {}, {} frames of "
                                "others received; check bit rate and wiring",
                                static_cast<double>(for_ns) / 1e9, can::to_string(s.state), heard));
    }
    std::string text;
    for (const auto& [id, n] : nodes) {
        const char* state = n.state ? n.booted && *n.state == canopen::NmtState::initialising
                                          ? "boot-up"
                                          : canopen::to_string(*n.state)
                                    : nullptr;
        if (options.json) {
            text += fmt::format(
                R"({}{{"node":{},"state":{},"device_type":{},"vendor":{},"product":{},"revision":{},"serial":{},"remark":"{}"}})",
                text.empty() ? "[" : ",\n ", id, state ? fmt::format("\"{}\"", state) : "null",
                member(n.type), member(n.identity[0]), member(n.identity[1]), member(n.identity[2]),
                member(n.identity[3]), remark(n));
        } else {
            if (text.empty()) {
                text = fmt::format("{:>4}  {:15}  {:10}  {:10}  {:10}  {:10}  {}\n", "node",
                                   "state", "type", "vendor", "product", "revision", "serial");
            }
            text += fmt::format("{:>4}  {:15}  {:10}  {:10}  {:10}  {:10}  {:10}  {}\n", id,
                                state ? state : "no heartbeat", cell(n.type), cell(n.identity[0]),
                                cell(n.identity[1]), cell(n.identity[2]), cell(n.identity[3]),
                                remark(n));
        }
    }
    return print(text + (options.json ? "]\n" : "")) ? 0 : 1;
}

}  // namespace hal::tools
