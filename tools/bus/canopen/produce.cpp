// SPDX-License-Identifier: MIT
// `hal can produce`: sends the periodic frames of a master: heartbeat, SYNC, guarding.
#include "bus/canopen/produce.hpp"

#include <fmt/core.h>

#include "bus/can/periodic.hpp"
#include "bus/canopen/node_client.hpp"
#include "canopen/protocol/numbers.hpp"
#include "cli/output.hpp"
#include "text/diagnostic.hpp"

namespace hal::tools {

int run_can_produce(const ProduceOptions& options) {
    const std::vector<std::string> kinds{"heartbeat", "sync", "guarding"};
    const std::string kind = options.words.size() > 1 ? options.words[1] : "";
    if (kind != "heartbeat" && kind != "sync" && kind != "guarding") {
        const std::string hint = did_you_mean(kind, kinds);
        return fail(options,
                    kind.empty()
                        ? "missing KIND; type: hal can produce ADDRESS heartbeat NODE | sync | "
                          "guarding NODE"
                        : fmt::format("unknown kind '{}'; {}", kind,
                                      hint.empty() ? "write heartbeat, sync or guarding" : hint));
    }
    std::uint8_t node = 0;
    const bool of_node = kind != "sync";
    if (options.words.size() != (of_node ? 3U : 2U)) {
        return fail(
            options,
            of_node
                ? fmt::format("expected one node; type: hal can produce ADDRESS {} NODE", kind)
                : fmt::format("unexpected argument '{}'; a SYNC has no node", options.words[2]));
    }
    if (of_node && !node_of(options, options.words[2], node)) return 1;
    if (options.counter > 240 || options.counter == 1) {
        return fail(options, fmt::format("invalid --counter {}; write 2..240", options.counter));
    }
    if (options.counter != 0 && of_node) return fail(options, "--counter is valid with sync only");
    Bus bus;
    if (!bus.open(options, options.words[0], false)) return 1;
    const std::int64_t usual = kind == "sync" ? 10'000'000 : 100'000'000;
    return send_periodically(bus, options, options.every_ns > 0 ? options.every_ns : usual,
                             [&](std::uint64_t n) {
        if (kind == "guarding") return can::Frame::request(0x700U + node, 1);
        if (kind == "heartbeat") {
            return can::Frame(0x700U + node,
                              {static_cast<std::uint8_t>(canopen::NmtState::operational)});
        }
        return options.counter == 0
                   ? can::Frame(0x80, {})
                   : can::Frame(0x80, {static_cast<std::uint8_t>(n % options.counter + 1)});
    });
}

}  // namespace hal::tools
