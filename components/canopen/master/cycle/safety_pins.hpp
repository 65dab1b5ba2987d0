// SPDX-License-Identifier: MIT
// The pins of the SRDOs of the nodes (EN 50325-5).
#pragma once

#include <array>
#include <deque>
#include <optional>
#include <string>

#include "canopen/protocol/srdo.hpp"
#include "hal/component.hpp"
#include "runner.hpp"

namespace hal::canopen {

class SafetyPins {
public:
    /// Declares the pins; none if no node has an SRDO. [setup]
    SafetyPins(Component& c, const Function& shows, const Runner& runner) {
        const auto& srdos = runner.own().srdos;
        if (srdos.empty()) return;
        for (const OwnSrdo& s : srdos) {
            const config::Node& node = runner.config().nodes[s.node];
            const std::string name =
                node.name + (s.pdo->to_node ? ".rsrdo" : ".tsrdo") + std::to_string(s.pdo->number);
            const std::string who = "SRDO " + std::to_string(s.pdo->number) + " of node " +
                                    std::to_string(node.setup.id) + " (" + node.name + "): ";
            Row& row = rows_.emplace_back(c, shows, name);
            if (!s.pdo->to_node) {
                row.received.emplace(c, shows, name);
            }
            for (std::size_t n = 0; n < row.words.size(); ++n) {
                row.words[n] = who + to_string(static_cast<SrdoFault>(n)) +
                               (s.pdo->to_node ? "" : "; its pins were set to their safe values");
            }
        }
        fail_safe_.emplace(c, shows, "fail-safe",
                           "rising edge: sends the global fail-safe command; all receivers enter "
                           "their safe state");
    }

    /// [realtime]
    void show(Runner& runner, Time now) noexcept {
        for (std::size_t n = 0; n < rows_.size(); ++n) {
            Row& row = rows_[n];
            const auto status = runner.srdo(n);
            row.count = static_cast<std::uint32_t>(status.count);
            if (!row.received) continue;
            row.received->valid = status.valid && runner.operational(runner.own().srdos[n].node);
            row.received->fault = static_cast<std::uint32_t>(status.fault);
            if (row.received->reset && !row.was_reset) {
                runner.acknowledge_srdo(n, now);
            }
            row.was_reset = row.received->reset;
        }
        if (!fail_safe_) return;
        if (*fail_safe_ && !was_fail_safe_) {
            runner.send_fail_safe();
        }
        was_fail_safe_ = *fail_safe_;
    }

    /// Nothing is sent. [realtime]
    void show_offline() noexcept {
        for (Row& row : rows_) {
            if (row.received) {
                row.received->valid = false;
            }
        }
    }

    /// Returns the message of a fault, formatted before the first cycle. [realtime]
    const char* words(std::size_t position, SrdoFault fault) const noexcept {
        return rows_[position].words[static_cast<std::size_t>(fault) & 7].c_str();
    }

private:
    struct Received {
        hal::Out<bool> valid;
        hal::Out<std::uint32_t> fault;
        hal::In<bool> reset;
        Received(Component& c, const Function& f, const std::string& n)
            : valid(c, f, (n + "-valid").c_str(),
                    "SRDO data valid; otherwise its pins have their safe values", {.safe = false}),
              fault(c, f, (n + "-fault").c_str(),
                    "why the data is invalid: 0 no fault, 1 late, 2 incomplete, 3 order, 4 length, "
                    "5 not inverted, "
                    "6 global fail-safe command"),
              reset(c, f, (n + "-reset").c_str(),
                    "rising edge: acknowledges the fault; the data is valid from the next valid "
                    "SRDO on") {}
    };
    struct Row {
        hal::Out<std::uint32_t> count;
        std::optional<Received> received;
        std::array<std::string, 8> words;
        bool was_reset = false;
        Row(Component& c, const Function& f, const std::string& n)
            : count(c, f, (n + "-count").c_str(), "SRDOs sent, or received and valid") {}
    };
    std::deque<Row> rows_;  // a pin may not move once it is declared
    std::optional<hal::In<bool>> fail_safe_;
    bool was_fail_safe_ = false;
};

}  // namespace hal::canopen
