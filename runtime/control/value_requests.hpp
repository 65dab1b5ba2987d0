// SPDX-License-Identifier: MIT
// The verbs about values and names: read, set, subscribe, unsubscribe, list, describe. Internal to
// the server.
#pragma once

#include <string>

#include <nlohmann/json.hpp>

#include "commands/shell.hpp"
#include "control/subscriptions.hpp"
#include "machine/session.hpp"

namespace hal {

/// Each verb appends the members of its reply after "ok":true, beginning with a comma, or throws
/// RequestError before anything. For the thread in Connection::handle().
class ValueRequests {
public:
    explicit ValueRequests(Shell& shell) : shell_(shell), session_(shell.session()) {}

    void read(const nlohmann::json& body, std::string& reply);
    void set(const nlohmann::json& body, std::string& reply);
    void subscribe(const nlohmann::json& body, std::string& reply);
    void unsubscribe(const nlohmann::json& body);
    void list(const nlohmann::json& body, std::string& reply);
    void describe(const nlohmann::json& body, std::string& reply);

    Subscriptions subscriptions;  ///< [any]

private:
    Shell& shell_;
    Session& session_;
};

}  // namespace hal
