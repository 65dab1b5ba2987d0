// SPDX-License-Identifier: MIT
// The verbs by which a program is a component: component, exchange, exit, port, stream.
// docs/protocol.md. Internal to the shell.
#pragma once

#include <cstdint>
#include <string>

#include <nlohmann/json_fwd.hpp>
#include <sys/types.h>

namespace hal {

class Session;
class Shell;

/// On whose behalf a request is executed.
struct Program {
    Shell& shell;
    Session& session;
    pid_t peer;
    std::uint64_t owner;  ///< the connection's number
};

// Each appends the members of its reply, beginning with a comma, or throws RequestError.
void declare_component(const Program& by, const nlohmann::json& body, std::string& reply);
void exchange_values(const Program& by, const nlohmann::json& body, std::string& reply);
void leave_component(const Program& by, const nlohmann::json& body);
void use_port(const Program& by, const nlohmann::json& body, std::string& reply);
void use_stream(const Program& by, const nlohmann::json& body, std::string& reply);

}  // namespace hal
