// SPDX-License-Identifier: MIT
// `hal can produce`: sends the periodic frames of a master: heartbeat, SYNC, guarding.
#include "bus/canopen/produce.hpp"

#include <fmt/core.h>

#include "bus/can/periodic.hpp"
#include "bus/canopen/node_client.hpp"
#include "canopen/protocol/numbers.hpp"
#include "cli/output.hpp"
#include "text/diagnostic.hpp"
#include "text/find_row.hpp"

namespace hal::tools {

namespace {

can::Frame heartbeat(std::uint8_t node, std::uint8_t, std::uint64_t) {
    return {0x700U + node, {static_cast<std::uint8_t>(canopen::NmtState::operational)}};
}

/// `counter`: the overflow value 1019h; 0: a SYNC without a counter.
can::Frame sync(std::uint8_t, std::uint8_t counter, std::uint64_t n) {
    if (counter == 0) return {0x80, {}};
    return {0x80, {static_cast<std::uint8_t>(n % counter + 1)}};
}

can::Frame guarding(std::uint8_t node, std::uint8_t, std::uint64_t) {
    return can::Frame::request(0x700U + node, 1);
}

struct Kind {
    const char* name;
    bool of_node;
    std::int64_t period_ns;  ///< without --every
    can::Frame (*frame)(std::uint8_t node, std::uint8_t counter, std::uint64_t n);
};
constexpr Kind kinds[] = {{"heartbeat", true, 100'000'000, heartbeat},
                          {"sync", false, 10'000'000, sync},
                          {"guarding", true, 100'000'000, guarding}};

int unknown_kind(const ProduceOptions& options, const std::string& name) {
    if (name.empty()) {
        return fail(options,
                    "missing KIND; type: hal can produce ADDRESS heartbeat NODE | sync | guarding "
                    "NODE");
    }
    const std::string hint = did_you_mean(name, {"heartbeat", "sync", "guarding"});
    return fail(options, fmt::format("unknown kind '{}'; {}", name,
                                     hint.empty() ? "write heartbeat, sync or guarding" : hint));
}

}  // namespace

int run_can_produce(const ProduceOptions& options) {
    const std::string name = options.words.size() > 1 ? options.words[1] : "";
    const Kind* const kind = find_row(kinds, name, &Kind::name);
    if (!kind) return unknown_kind(options, name);
    if (options.words.size() != (kind->of_node ? 3U : 2U)) {
        return fail(
            options,
            kind->of_node
                ? fmt::format("expected one node; type: hal can produce ADDRESS {} NODE", name)
                : fmt::format("unexpected argument '{}'; a SYNC has no node", options.words[2]));
    }
    std::uint8_t node = 0;
    if (kind->of_node && !node_of(options, options.words[2], node)) return 1;
    if (options.counter > 240 || options.counter == 1) {
        return fail(options, fmt::format("invalid --counter {}; write 2..240", options.counter));
    }
    if (options.counter != 0 && kind->of_node)
        return fail(options, "--counter is valid with sync only");
    Bus bus;
    if (!bus.open(options, options.words[0], false)) return 1;
    const std::int64_t period_ns = options.every_ns > 0 ? options.every_ns : kind->period_ns;
    return send_periodically(bus, options, period_ns, [&](std::uint64_t n) {
        return kind->frame(node, static_cast<std::uint8_t>(options.counter), n);
    });
}

}  // namespace hal::tools
