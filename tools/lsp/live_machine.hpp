// SPDX-License-Identifier: MIT
// The running machine beside an editor: values, faults, edits. The editor waits for no machine that
// does not answer.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "control/client.hpp"
#include "netlist/netlist.hpp"

namespace hal::tools {

/// [setup]
class LiveMachine {
public:
    /// `name` of the instance; empty: the one that a command without --name would use.
    explicit LiveMachine(std::string name = "") : name_(std::move(name)) {}

    void set_name(const std::string& name);
    /// Connects unless connected, at most once a second. Returns whether a machine answers.
    bool connect();
    /// The instance; empty while none is connected.
    std::string instance() const;

    /// Returns the present values of pins, parameters and signals, as getp prints them; a name that
    /// the machine does not have is missing.
    std::map<std::string, std::string> values(const std::vector<std::string>& names);

    struct Fault {
        std::string thread;
        std::string sentence;
    };
    /// Returns the faults that are not acknowledged, the newest first.
    std::vector<Fault> faults();

    struct Applied {
        bool good = false;
        std::string text;  ///< what the machine printed, or why nothing was sent
    };
    /// A text of commands and what messages call it.
    struct Part {
        std::string name;
        std::string text;
    };
    /// Runs all parts as one transaction: all take effect at the same cycle boundary, or none does.
    /// [SECTION]KEY means what `ini` has.
    Applied apply(const std::vector<Part>& parts, const Ini& ini, const std::string& directory);

private:
    /// Sends a request and waits for its reply for at most `timeout_ms`; null after that, when the
    /// connection is given up.
    nlohmann::json ask(nlohmann::json request, int timeout_ms);

    std::string name_;
    std::unique_ptr<Client> client_;
    std::int64_t last_attempt_ms_ = -1'000'000;
};

}  // namespace hal::tools
