// SPDX-License-Identifier: MIT
// The verbs that execute commands: run, script, options, complete. Internal to the server.
#pragma once

#include <functional>
#include <map>
#include <string>

#include <nlohmann/json.hpp>

#include "commands/shell.hpp"

namespace hal {

/// Each verb appends the members of its reply after "ok":true, beginning with a comma, or throws
/// RequestError before anything. For the thread in Connection::handle().
class CommandRequests {
public:
    explicit CommandRequests(Shell& shell) : shell_(shell) {}

    void run(const nlohmann::json& body, std::string& reply);
    void script(const nlohmann::json& body, std::string& reply);
    void options(const nlohmann::json& body);
    void complete(const nlohmann::json& body, std::string& reply);

    /// Receives the lines that a command which waits has for the client meanwhile.
    std::function<void(std::string)> event;

private:
    void execute(const nlohmann::json& body, const std::string& text, bool script,
                 std::string& reply);
    void look_up(const nlohmann::json& variables);

    Shell& shell_;
    std::map<std::string, std::string> environment_;  // $NAME in the request being executed
};

}  // namespace hal
