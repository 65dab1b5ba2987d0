// SPDX-License-Identifier: MIT
// `hal can nmt`: sends an NMT command.
#include "bus/canopen/nmt.hpp"

#include <fmt/core.h>
#include <utility>
#include <vector>

#include "bus/can/bus.hpp"
#include "canopen/protocol/numbers.hpp"
#include "cli/output.hpp"
#include "text/diagnostic.hpp"
#include "text/numbers.hpp"

namespace hal::tools {

int run_can_nmt(const NmtOptions& options) {
    using canopen::NmtCommand;
    constexpr std::pair<const char*, NmtCommand> commands[] = {
        {"start", NmtCommand::start},
        {"stop", NmtCommand::stop},
        {"preop", NmtCommand::enter_pre_operational},
        {"reset", NmtCommand::reset_node},
        {"reset-comm", NmtCommand::reset_communication},
    };
    if (options.words.size() != 3) {
        return fail(options,
                    "expected ADDRESS COMMAND NODE; type: hal can nmt ADDRESS "
                    "start|stop|preop|reset|reset-comm NODE|all");
    }
    const std::string &word = options.words[1], &node_text = options.words[2];
    const NmtCommand* command = nullptr;
    std::vector<std::string> names;
    for (const auto& [name, value] : commands) {
        names.emplace_back(name);
        if (word == name) {
            command = &value;
        }
    }
    if (!command) {
        const std::string hint = did_you_mean(word, names);
        return fail(
            options,
            fmt::format("unknown command '{}'; {}", word,
                        hint.empty() ? "write start, stop, preop, reset or reset-comm" : hint));
    }
    const bool all = node_text == "all";
    const std::uint64_t node = all ? 0 : parse_natural(node_text).value_or(0);
    if (!all && (node < 1 || node > 127)) {
        return fail(options, fmt::format("invalid node '{}'; write 1..127, or all", node_text));
    }
    Bus bus;
    if (!bus.open(options, options.words[0], false)) return 1;
    send_with_timeout(bus, can::Frame(0x000, {static_cast<std::uint8_t>(*command),
                                              static_cast<std::uint8_t>(node)}));
    return finish_sending(bus, options, 1);
}

}  // namespace hal::tools
