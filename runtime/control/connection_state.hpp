// SPDX-License-Identifier: MIT
// What a Connection holds, and its verbs: each in the file of its kind. Internal to the server.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <string>

#include <nlohmann/json.hpp>

#include "commands/shell.hpp"
#include "control/connection.hpp"
#include "control/probe_feeds.hpp"
#include "control/program_requests.hpp"
#include "control/request.hpp"
#include "control/subscriptions.hpp"
#include "control/trace_feed.hpp"
#include "machine/processes/programs.hpp"
#include "machine/session.hpp"

namespace hal {

using Json = nlohmann::json;

struct Connection::State {
    State(Shell& main, pid_t client) : shell(main, {}), session(main.session()), peer(client) {}

    Shell shell;
    Session& session;
    pid_t peer;
    /// of the components that this client answers for
    const std::uint64_t owner = session.programs().new_owner();
    Subscriptions subscriptions;
    ProbeFeeds probes{session};
    TraceFeed traces{session};
    std::atomic<std::uint64_t> requests{0};
    std::atomic<std::uint64_t> rubbish{0};
    /// the client has declared one since idle() last found none
    std::atomic<bool> has_component{false};
    /// a request is being executed, or `begin` is open since the last one
    std::atomic<bool> engaged{false};
    // What follows, and the shell's members beside cancel(), belong to the thread in handle().
    /// what $NAME is in the request being executed
    std::map<std::string, std::string> environment;
    bool stop = false;
    /// a request was rejected because the machine ends
    bool told_end = false;
    std::uint64_t halt_ticket = 0;
    std::function<void(std::string)> event;

    // Each appends the members of its reply after "ok":true, beginning with a comma, or throws
    // RequestError before anything.
    void run(const Json& body, std::string& reply);
    void script(const Json& body, std::string& reply);
    void options(const Json& body, std::string& reply);
    void read(const Json& body, std::string& reply);
    void set(const Json& body, std::string& reply);
    void subscribe(const Json& body, std::string& reply);
    void unsubscribe(const Json& body, std::string& reply);
    void probe(const Json& body, std::string& reply);
    void unprobe(const Json& body, std::string& reply);
    void journal(const Json& body, std::string& reply);
    void trace(const Json& body, std::string& reply);
    void list(const Json& body, std::string& reply);
    void describe_kind(const Json& body, std::string& reply);
    void complete(const Json& body, std::string& reply);
    void component(const Json& body, std::string& reply) {
        no_begin("component");
        has_component = true;
        declare_component({shell, session, peer, owner}, body, reply);
    }
    void exchange(const Json& body, std::string& reply) {
        exchange_values({shell, session, peer, owner}, body, reply);
    }
    void exit(const Json& body, std::string&) {
        no_begin("exit");
        leave_component({shell, session, peer, owner}, body);
    }
    void port(const Json& body, std::string& reply) {
        use_port({shell, session, peer, owner}, body, reply);
    }
    void stream(const Json& body, std::string& reply) {
        use_stream({shell, session, peer, owner}, body, reply);
    }
    void end(const Json& body, std::string&) {
        if (body["stop"] != true) {
            throw RequestError{"stop must be true"};
        }
        stop = true;
    }
    void cancelled(const Json& body, std::string&) {
        if (body["cancel"] != true) {
            throw RequestError{"cancel must be true"};
        }
    }

    /// A verb that changes the model at once is not for a connection that collects edits.
    void no_begin(const char* verb) const {
        if (shell.collecting()) {
            throw RequestError{std::string("'") + verb +
                               "' cannot be part of a transaction; this connection has an open "
                               "'begin': commit or abort it first"};
        }
    }
    void execute(const Json& body, const std::string& text, bool script, std::string& reply);

    /// While a request is being executed.
    class Engaged {
    public:
        explicit Engaged(State& state) : state_(state) { state_.engaged = true; }
        ~Engaged() { state_.engaged = state_.shell.collecting(); }
        Engaged(const Engaged&) = delete;

    private:
        State& state_;
    };
};

}  // namespace hal
