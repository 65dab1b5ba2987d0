// SPDX-License-Identifier: MIT
// `hal can scan`: finds CANopen nodes. All 127 are queried at once for type and identity while
// heartbeats are received.
#include "bus/canopen/scan.hpp"

#include <fmt/core.h>
#include <map>
#include <optional>
#include <unistd.h>

#include "bus/can/bus.hpp"
#include "bus/canopen/sdo.hpp"
#include "canopen/protocol/numbers.hpp"
#include "cli/output.hpp"

namespace hal::tools {

namespace {

struct Node {
    std::optional<canopen::NmtState> state;
    std::optional<std::uint32_t> type, identity[4];
    std::string abort;  ///< of the read of its type
    unsigned unexpected_responses = 0;
    bool booted = false;
};

std::string cell(const std::optional<std::uint32_t>& value) {
    return value ? fmt::format("0x{:08X}", *value) : "-";
}
std::string member(const std::optional<std::uint32_t>& value) {
    return value ? fmt::format("{}", *value) : "null";
}

/// Returns the profile of object 1000h: "402 drive", "401 I/O module", …
std::string profile_name(std::uint32_t device_type) {
    constexpr std::pair<std::uint32_t, const char*> known[] = {
        {0, "no profile"},
        {401, "I/O module"},
        {402, "drive"},
        {404, "measuring device"},
        {405, "programmable controller"},
        {406, "encoder"},
        {408, "hydraulic drive"},
        {410, "inclinometer"},
        {418, "battery"},
        {419, "charger"},
    };
    for (const auto& [number, word] : known) {
        if ((device_type & 0xffff) == number) {
            return number == 0 ? word : fmt::format("{} {}", number, word);
        }
    }
    return fmt::format("profile {}", device_type & 0xffff);
}

std::string remark(const Node& n) {
    if (n.unexpected_responses > 1) return "more than one response: possible duplicate node ID";
    if (!n.abort.empty()) return "cannot read its type: " + n.abort;
    if (!n.type) return "no response to SDO requests";
    return profile_name(*n.type);
}

/// Returns nullptr for a node without heartbeat.
const char* state_text(const Node& n) {
    if (!n.state) return nullptr;
    const bool boot_up = n.booted && *n.state == canopen::NmtState::initialising;
    return boot_up ? "boot-up" : canopen::to_string(*n.state);
}

bool is_heartbeat(const can::Frame& f) {
    if (f.own || f.error || f.extended || f.remote) return false;
    return f.length == 1 && f.id > 0x700 && f.id <= 0x77f;
}

/// The nodes that send heartbeats or respond to a read.
class NodeScan {
public:
    NodeScan() {
        for (std::uint8_t node = 1; node <= 127; ++node) {
            reads_.ask(node, type_index, 0);
        }
        reads_.on_answer = [this](const ParallelReads::Answer& answer) { apply(answer); };
    }

    void receive(const can::Frame& f) {
        received_ += !f.own && !f.error;
        reads_.handle(f);
        if (!is_heartbeat(f)) return;
        Node& n = nodes_[f.id & 0x7f];
        n.state = static_cast<canopen::NmtState>(f.data[0] & 0x7f);
        n.booted = n.booted || f.data[0] == 0;
    }
    void poll(can::Link& link) { reads_.poll(link, 8); }

    const std::map<unsigned, Node>& nodes() const { return nodes_; }
    /// Returns the number of frames of others.
    std::uint64_t received() const { return received_; }

private:
    static constexpr std::uint16_t type_index = 0x1000;
    static constexpr std::uint16_t identity_index = 0x1018;

    void apply(const ParallelReads::Answer& answer) {
        Node& n = nodes_[answer.node];
        if (!answer.asked) {
            ++n.unexpected_responses;
        } else if (answer.index == type_index) {
            apply_type(n, answer);
        } else if (answer.abort == 0) {
            n.identity[answer.sub - 1] = answer.value;
        }
    }
    void apply_type(Node& n, const ParallelReads::Answer& answer) {
        if (answer.abort == 0) {
            n.type = answer.value;
        } else {
            n.abort = canopen::to_string(static_cast<canopen::Abort>(answer.abort));
        }
        for (std::uint8_t sub = 1; sub <= 4; ++sub) {
            reads_.ask(answer.node, identity_index, sub);
        }
    }

    std::map<unsigned, Node> nodes_;
    ParallelReads reads_;
    std::uint64_t received_ = 0;
};

std::string table_of(const std::map<unsigned, Node>& nodes) {
    std::string text = fmt::format("{:>4}  {:15}  {:10}  {:10}  {:10}  {:10}  {}\n", "node",
                                   "state", "type", "vendor", "product", "revision", "serial");
    for (const auto& [id, n] : nodes) {
        const char* const state = state_text(n);
        text +=
            fmt::format("{:>4}  {:15}  {:10}  {:10}  {:10}  {:10}  {:10}  {}\n", id,
                        state ? state : "no heartbeat", cell(n.type), cell(n.identity[0]),
                        cell(n.identity[1]), cell(n.identity[2]), cell(n.identity[3]), remark(n));
    }
    return text;
}

std::string json_of(const std::map<unsigned, Node>& nodes) {
    std::string text;
    for (const auto& [id, n] : nodes) {
        const char* const state = state_text(n);
        const char* const separator = text.empty() ? "[" : ",\n ";
        text += fmt::format(
            R"({}{{"node":{},"state":{},"device_type":{},"vendor":{},"product":{},"revision":{},"serial":{},"remark":"{}"}})",
            separator, id, state ? fmt::format("\"{}\"", state) : "null", member(n.type),
            member(n.identity[0]), member(n.identity[1]), member(n.identity[2]),
            member(n.identity[3]), remark(n));
    }
    return text + "]\n";
}

}  // namespace

int run_can_scan(const ScanOptions& options) {
    Bus bus;
    if (!bus.open(options, options.words[0], false)) return 1;
    NodeScan scan;
    const std::int64_t for_ns = options.for_ns >= 0 ? options.for_ns : 1'000'000'000;
    const auto receive = [&](std::span<const can::Frame> batch) {
        for (const can::Frame& f : batch) {
            scan.receive(f);
        }
        return true;
    };
    listen(bus, for_ns, receive, 1'000'000, [&] { scan.poll(*bus.link); });
    if (scan.nodes().empty()) {
        const can::Statistics s = bus.link->statistics();
        return fail(options, fmt::format("no node responded within {:g} s; the bus is {}, {} "
                                         "frames of others received; check bit rate and wiring",
                                         static_cast<double>(for_ns) / 1e9, can::to_string(s.state),
                                         scan.received()));
    }
    const std::string text = options.json ? json_of(scan.nodes()) : table_of(scan.nodes());
    return exit_code(print(text));
}

}  // namespace hal::tools
