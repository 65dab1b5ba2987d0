// SPDX-License-Identifier: MIT
// `hal node mesa`: an emulated card as a process.
#include <algorithm>
#include <cmath>
#include <fmt/core.h>

#include "bus/config/values.hpp"
#include "bus/mesa/options.hpp"
#include "bus/timeline/plan_output.hpp"
#include "cli/output.hpp"
#include "cli/signals.hpp"
#include "hal/read_file.hpp"
#include "link/datagram_listener.hpp"
#include "link/system.hpp"
#include "mesa/card/card_server.hpp"
#include "text/numbers.hpp"

namespace hal::tools {

namespace {

using namespace mesa;

bool read_card_file(const Options& options, const std::string& file, CardReadResult& result) {
    std::string text;
    if (!read_regular_file(file, 65536, text)) {
        fail(options, "cannot read '" + file + "': " + text);
        return false;
    }
    result = read_card(text, file);
    return print_findings(file, text, result.messages, [](const auto& message) {
        return Code::named(code_of(message.topic)).value_or(Code("mesa-line"));
    });
}

/// Parses INPUT=yes and sets the input. Returns the problem, or "".
std::string apply_setting(EmulatedCard& card, const std::string& text) {
    const auto equals = text.find('=');
    const auto value =
        equals != text.npos ? hal::bus::parse_flag(text.substr(equals + 1)) : std::nullopt;
    if (!value) return "invalid --set '" + text + "'; write INPUT=yes or INPUT=no";
    const std::string name = text.substr(0, equals);
    const auto& inputs = card.config().inputs;
    const auto found = std::ranges::find(inputs, name, &WireConfig::name);
    if (found == inputs.end()) return "--set '" + text + "': there is no input " + name;
    card.set_input(static_cast<std::size_t>(found - inputs.begin()), *value);
    return {};
}

/// Parses 0.01 or 1%. Returns whether it is valid.
bool parse_share(std::string text, double& share) {
    const bool is_percent = text.ends_with('%');
    if (is_percent) {
        text.pop_back();
    }
    const auto value = parse_real(text);
    if (!value) return false;
    share = is_percent ? *value / 100.0 : *value;
    return share >= 0.0 && share <= 1.0;
}

/// Prints the machine when it has changed.
class MachineReport {
public:
    /// Returns false when nobody reads it.
    bool print_changes(const EmulatedCard& card, std::int64_t since_ns) {
        const std::string now = text_of(card);
        if (now == last_) return true;
        last_ = now;
        return print(fmt::format("{:.3f} s: {}\n", static_cast<double>(since_ns) / 1e9, now));
    }

private:
    static std::string text_of(const EmulatedCard& card) {
        std::string text = card.has_bitten() ? "watchdog has bitten" : "watchdog has not bitten";
        const CardConfig& config = card.config();
        for (std::size_t n = 0; n < config.motors.size(); ++n) {
            text += fmt::format(", {} {:.3f}", config.motors[n].name, card.plant().position(n));
        }
        for (std::size_t n = 0; n < config.spindles.size(); ++n) {
            const double rpm = std::round(card.plant().rpm(n));
            text += fmt::format(", {} {:.0f} rpm", config.spindles[n].name, rpm + 0.0);
        }
        for (std::size_t n = 0; n < config.outputs.size(); ++n) {
            text += fmt::format(", {} {}", config.outputs[n].name, card.output(n) ? "on" : "off");
        }
        return text;
    }

    std::string last_;
};

/// Where the card listens: the option, the file, or the loopback interface.
std::string address_of(const MesaNodeOptions& options, const CardConfig& card) {
    if (!options.address.empty()) return options.address;
    const bool has_own = !card.address.empty() && !datagram::describe(card.address).in_memory;
    return has_own ? card.address : "127.0.0.1";
}

/// Applies the faults, losses and inputs of the command line. Returns the problem, or "".
std::string prepare(const MesaNodeOptions& options, EmulatedCard& card, CardServer& server) {
    for (const std::string& text : options.faults) {
        CardFault fault;
        if (const std::string problem = parse_card_fault(text, fault); !problem.empty()) {
            return "--fault: " + problem;
        }
        server.faults().push_back(fault);
    }
    for (const std::string& text : options.settings) {
        if (const std::string problem = apply_setting(card, text); !problem.empty()) {
            return problem;
        }
    }
    double loss = 0.0;
    if (!options.loss.empty() && !parse_share(options.loss, loss)) {
        return "invalid --loss '" + options.loss + "'; write a share, as in 0.01 or 1%";
    }
    server.set_loss(loss);
    return {};
}

}  // namespace

int run_node_mesa(const MesaNodeOptions& options) {
    CardReadResult result;
    if (!read_card_file(options, options.words[0], result)) return 1;
    StopRequest stop;
    auto opened = datagram::listen(address_of(options, result.card), udp_port);
    if (!opened) return fail(options, opened.problem);
    EmulatedCard card(result.card, opened.listener->mac());
    CardServer server(card);
    if (const std::string problem = prepare(options, card, server); !problem.empty()) {
        return fail(options, problem);
    }
    print(fmt::format("mesa: {} at {}\n", result.card.model->type, opened.listener->address()));
    MachineReport report;
    constexpr std::int64_t turn_ns = 5'000'000;
    const std::int64_t begin_ns = link::monotonic_ns();
    while (!stop.requested()) {
        const std::int64_t now_ns = link::monotonic_ns();
        if (options.for_ns >= 0 && now_ns - begin_ns >= options.for_ns) break;
        opened.listener->serve(server, turn_ns);
        server.advance(now_ns);  // what arrived before has been handled
        if (options.verbose && !report.print_changes(card, now_ns - begin_ns)) break;
    }
    print(fmt::format("mesa: {} requests, {} bites of the watchdog, {} datagrams lost\n",
                      card.requests(), card.bites(), server.lost()));
    return 0;
}

}  // namespace hal::tools
