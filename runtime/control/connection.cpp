// SPDX-License-Identifier: MIT
#include "control/connection.hpp"

#include <algorithm>
#include <atomic>
#include <utility>
#include <vector>

#include <unistd.h>

#include "commands/json_text.hpp"
#include "commands/shell.hpp"
#include "control/command_requests.hpp"
#include "control/probe_requests.hpp"
#include "control/program_requests.hpp"
#include "control/request.hpp"
#include "control/value_requests.hpp"
#include "machine/processes/programs.hpp"
#include "machine/session.hpp"
#include "paths.hpp"

namespace hal {

using Json = nlohmann::json;

struct Connection::State {
    State(Shell& main, pid_t client) : shell(main, {}), session(main.session()), peer(client) {}

    /// On whose behalf a verb of a component is executed.
    Program program() { return {shell, session, peer, owner}; }
    /// A verb that changes the model at once is not for a connection that collects edits.
    void reject_in_transaction(const char* verb) const {
        if (!shell.collecting()) return;
        throw RequestError{std::string("'") + verb +
                           "' cannot be part of a transaction; this connection has an open "
                           "'begin': commit or abort it first"};
    }

    /// A component would keep a connection that is reserved for commands, such as `stop`.
    void reject_if_reserved() const {
        const std::size_t max_clients = reserved_beyond;
        if (max_clients == 0) return;
        throw RequestError{"no connection is left for a component: " + std::to_string(max_clients) +
                           " clients are connected, and further connections are reserved for "
                           "commands; end a program ('show comp' lists them), or give one "
                           "component the pins of several"};
    }

    /// While a request is being executed.
    class Engaged {
    public:
        explicit Engaged(State& state) : state_(state) { state_.engaged = true; }
        ~Engaged() { state_.engaged = state_.shell.collecting(); }
        Engaged(const Engaged&) = delete;

    private:
        State& state_;
    };

    Shell shell;  // beside cancel(): for the thread in handle()
    Session& session;
    const pid_t peer;
    /// of the components that this client answers for
    const std::uint64_t owner = session.programs().new_owner();
    CommandRequests commands{shell};
    ValueRequests values{shell};
    ProbeRequests probes{session};
    std::atomic<std::uint64_t> requests{0};
    std::atomic<std::uint64_t> invalid_requests{0};
    /// the client has declared one since idle() last found none
    std::atomic<bool> has_component{false};
    /// It is reserved for commands, because so many clients are connected; 0: it is not. Written by
    /// the server's thread before each turn, read in handle().
    std::atomic<std::size_t> reserved_beyond{0};
    /// a request is being executed, or `begin` is open since the last one
    std::atomic<bool> engaged{false};
    // What follows belongs to the thread in handle().
    bool stop = false;
    /// a request was rejected because the machine ends, and the client has no component
    bool told_end = false;
    std::uint64_t halt_ticket = 0;
};

namespace {

constexpr int max_depth = 16;  // brackets within brackets of a request

/// Arrays and objects in each other, counted without building them: a hostile line costs one pass.
bool too_deep(std::string_view line) {
    int depth = 0;
    bool quoted = false;
    for (std::size_t i = 0; i < line.size(); ++i) {
        const char c = line[i];
        if (quoted) {
            if (c == '\\') {
                ++i;
            } else if (c == '"') {
                quoted = false;
            }
        } else if (c == '"') {
            quoted = true;
        } else if (c == '[' || c == '{') {
            if (++depth > max_depth) return true;
        } else if (c == ']' || c == '}') {
            --depth;
        }
    }
    return false;
}

std::string dumped(const Json& value) {
    return value.dump(-1, ' ', false, Json::error_handler_t::replace);
}

/// What a verb is for, where requests of its kind are treated differently.
enum class VerbKind : std::uint8_t {
    ordinary,
    command,       ///< executes commands, which may wait
    urgent,        ///< is executed by the server's own thread
    inspection,    ///< may be abandoned halfway when the machine ends
    until_closed,  ///< is executed until the connection is closed, also while the machine ends
};

struct Verb {
    const char* name;
    VerbKind kind;
    const char* members;  ///< beside the verb itself and id, each followed by a blank
    /// Appends the members of the reply after "ok":true, beginning with a comma, or throws
    /// RequestError before anything.
    void (*handle)(Connection::State&, const Json& body, std::string& reply);

    bool ends_instance() const { return std::string_view(name) == "stop"; }
};

void declare(Connection::State& s, const Json& body, std::string& reply) {
    s.reject_in_transaction("component");
    s.reject_if_reserved();
    s.has_component = true;
    declare_component(s.program(), body, reply);
}

void leave(Connection::State& s, const Json& body, std::string&) {
    s.reject_in_transaction("exit");
    leave_component(s.program(), body);
}

void stop(Connection::State& s, const Json& body, std::string&) {
    if (body["stop"] != true) {
        throw RequestError{"stop must be true"};
    }
    s.stop = true;
}

/// A command that is being executed is cancelled by cancels(); here none is.
void cancel_nothing(Connection::State&, const Json& body, std::string&) {
    if (body["cancel"] != true) {
        throw RequestError{"cancel must be true"};
    }
}

using Held = Connection::State;
constexpr Verb verbs[] = {
    {"run", VerbKind::command, "name line env ",
     [](Held& s, const Json& body, std::string& reply) { s.commands.run(body, reply); }},
    {"script", VerbKind::command, "name env ",
     [](Held& s, const Json& body, std::string& reply) { s.commands.script(body, reply); }},
    {"options", VerbKind::urgent, "",
     [](Held& s, const Json& body, std::string&) { s.commands.options(body); }},
    {"read", VerbKind::ordinary, "",
     [](Held& s, const Json& body, std::string& reply) { s.values.read(body, reply); }},
    {"set", VerbKind::ordinary, "",
     [](Held& s, const Json& body, std::string& reply) { s.values.set(body, reply); }},
    {"subscribe", VerbKind::ordinary, "every_ms changes ",
     [](Held& s, const Json& body, std::string& reply) { s.values.subscribe(body, reply); }},
    {"unsubscribe", VerbKind::ordinary, "",
     [](Held& s, const Json& body, std::string&) { s.values.unsubscribe(body); }},
    {"probe", VerbKind::ordinary, "every batch_ms buffer_ms ",
     [](Held& s, const Json& body, std::string& reply) { s.probes.probe(body, reply); }},
    {"unprobe", VerbKind::ordinary, "",
     [](Held& s, const Json& body, std::string& reply) { s.probes.unprobe(body, reply); }},
    {"journal", VerbKind::ordinary, "",
     [](Held& s, const Json& body, std::string&) { s.probes.journal(body); }},
    {"trace", VerbKind::ordinary, "",
     [](Held& s, const Json& body, std::string& reply) { s.probes.trace(body, reply); }},
    {"list", VerbKind::inspection, "patterns ",
     [](Held& s, const Json& body, std::string& reply) { s.values.list(body, reply); }},
    {"describe", VerbKind::inspection, "patterns type histograms ",
     [](Held& s, const Json& body, std::string& reply) { s.values.describe(body, reply); }},
    {"complete", VerbKind::ordinary, "cursor ",
     [](Held& s, const Json& body, std::string& reply) { s.commands.complete(body, reply); }},
    {"component", VerbKind::ordinary, "prefix pins ready timeout_ms every_ms safe ", declare},
    {"exchange", VerbKind::until_closed, "write read alive ",
     [](Held& s, const Json& body, std::string& reply) {
    exchange_values(s.program(), body, reply);
}},
    {"exit", VerbKind::until_closed, "", leave},
    {"port", VerbKind::until_closed, "read peek write ",
     [](Held& s, const Json& body, std::string& reply) { use_port(s.program(), body, reply); }},
    {"stream", VerbKind::until_closed, "take records create owner ",
     [](Held& s, const Json& body, std::string& reply) { use_stream(s.program(), body, reply); }},
    {"stop", VerbKind::urgent, "", stop},
    {"cancel", VerbKind::ordinary, "", cancel_nothing},
};

/// True when `word` is one of those in `words`, each followed by a blank.
bool listed_in(std::string_view words, std::string_view word) {
    for (std::size_t at = 0, blank; (blank = words.find(' ', at)) != words.npos; at = blank + 1) {
        if (words.substr(at, blank - at) == word) return true;
    }
    return false;
}

/// The one verb of a request; rejects unknown members, so that a misspelt one is not silently
/// ignored.
const Verb& verb_of(const Json& body) {
    const Verb* found = nullptr;
    for (auto entry = body.begin(); entry != body.end(); ++entry) {
        const auto verb = std::find_if(std::begin(verbs), std::end(verbs),
                                       [&](const Verb& v) { return entry.key() == v.name; });
        if (verb == std::end(verbs)) continue;
        // read is a member of exchange, too
        if (found && listed_in(found->members, verb->name)) continue;
        if (found && !listed_in(verb->members, found->name)) {
            throw RequestError{std::string("a request has one verb, not both ") + found->name +
                               " and " + verb->name};
        }
        found = verb;
    }
    if (!found) {
        std::vector<std::string> names;
        for (const Verb& verb : verbs) {
            names.emplace_back(verb.name);
        }
        throw RequestError{"missing verb; a request has one of: " + listed(names, names.size())};
    }
    for (auto entry = body.begin(); entry != body.end(); ++entry) {
        const std::string& key = entry.key();
        if (key != "id" && key != found->name && !listed_in(found->members, key)) {
            throw RequestError{"'" + key.substr(0, 60) +
                               "' is not a valid member of a request to " + found->name};
        }
    }
    return *found;
}

}  // namespace

Connection::Connection(Shell& shell, pid_t peer) : state_(new State(shell, peer)) {}

Connection::~Connection() {
    const auto lock = state_->session.lock();
    state_->session.programs().withdraw(state_->owner);
}

void Connection::on_event(std::function<void(std::string)> take) {
    state_->commands.event = std::move(take);
}

void Connection::reserve(std::size_t max_clients) {
    state_->reserved_beyond = max_clients;
}

bool Connection::idle() const {
    const State& s = *state_;
    if (s.engaged || !s.values.subscriptions.empty() || !s.probes.empty()) return false;
    if (!s.has_component) return true;
    const auto lock = state_->session.try_lock();
    if (!lock || state_->session.programs().answers(state_->owner)) return false;
    state_->has_component = false;
    return true;
}

std::string Connection::hello() const {
    return json_text({{"halcyon", 1},
                      {"name", state_->session.options().name},
                      {"version", paths::version},
                      {"pid", getpid()},
                      {"files", state_->session.options().files}}) +
           "\n";
}

namespace {

bool may_be_id(const Json& value) {
    return value.is_number() ||
           (value.is_string() && value.get_ref<const std::string&>().size() <= 200);
}

/// Returns the id of a request as it is repeated in the reply.
std::string id_text(const Json& body) {
    const Json& id = member(body, "id");
    return may_be_id(id) ? dumped(id) : "null";
}

/// Returns true for commands that may wait: a line, or a command as a list.
bool may_wait_for(const Json& commands) {
    const Json* first = &commands;
    if (commands.is_array() && !commands.empty()) {
        first = &commands[0];
    }
    return first->is_string() && Shell::may_wait(first->get_ref<const std::string&>());
}

/// Appends the reply of a request that is rejected.
Connection::Handled reject(std::string& replies, const std::string& id,
                           const std::string& sentence) {
    replies += "{\"id\":" + id + ",\"ok\":false,\"error\":";
    json_quote(replies, sentence);
    replies += "}\n";
    return Connection::Handled::done;
}

constexpr const char* machine_ends = "the machine ends";

}  // namespace

Connection::Handled Connection::handle(std::string_view line, std::string& replies, bool may_wait) {
    State& state = *state_;
    const State::Engaged engaged(state);
    if (too_deep(line)) {
        ++state.invalid_requests;
        return reject(replies, "null",
                      "more than " + std::to_string(max_depth) + " nested brackets");
    }
    const Json body = Json::parse(line.begin(), line.end(), nullptr, false);
    if (!body.is_object()) {
        ++state.invalid_requests;
        return reject(replies, "null",
                      body.is_discarded() ? "invalid JSON; a request is one JSON object on one line"
                                          : "a request is a JSON object");
    }
    const std::string id = id_text(body);
    const std::size_t before = replies.size();
    try {
        const Verb& verb = verb_of(body);
        // A program's values go on until the connection is closed, which is what it takes for the
        // end of the machine.
        const bool goes_on = verb.kind == VerbKind::until_closed || verb.ends_instance();
        if (state.session.ending() && !goes_on) {
            state.told_end = !state.has_component;
            return reject(replies, id, machine_ends);
        }
        if (!may_wait && verb.kind == VerbKind::command && may_wait_for(body[verb.name])) {
            return Handled::wants_thread;
        }
        ++state.requests;
        replies += "{\"id\":" + id + ",\"ok\":true";
        verb.handle(state, body, replies);
        if (verb.kind == VerbKind::inspection && state.session.ending()) {
            replies.resize(before);  // it may have been abandoned halfway
            state.told_end = !state.has_component;
            return reject(replies, id, machine_ends);
        }
        replies += "}\n";
    } catch (const RequestError& refusal) {
        replies.resize(before);
        return reject(replies, id, refusal.sentence);
    } catch (const std::bad_alloc&) {
        replies.resize(before);
        return reject(replies, id, "not enough memory for this request");
    }
    return std::exchange(state.stop, false) ? Handled::stop : Handled::done;
}

namespace {

constexpr std::size_t max_urgent_size = std::size_t{64} << 10;

/// True for `stop` and ["stop"].
bool is_stop(const Json& command) {
    if (command.is_array()) return command.size() == 1 && command[0] == "stop";
    if (!command.is_string()) return false;
    const std::string& text = command.get_ref<const std::string&>();
    const auto first = text.find_first_not_of(" \t");
    const auto last = text.find_last_not_of(" \t");
    return first != text.npos && std::string_view(text).substr(first, last - first + 1) == "stop";
}

}  // namespace

bool Connection::told_end() const { return state_->told_end; }

Connection::Urgent Connection::execute_urgent(std::string_view line, std::string& reply) {
    State& state = *state_;
    const bool stops = line.find("stop") != line.npos;
    if (line.size() > max_urgent_size || (!stops && line.find("\"options\"") == line.npos) ||
        too_deep(line)) {
        return Urgent::no;
    }
    const Json body = Json::parse(line.begin(), line.end(), nullptr, false);
    if (!body.is_object()) return Urgent::no;
    try {
        const Verb& verb = verb_of(body);
        if (verb.kind == VerbKind::urgent) {
            return handle(line, reply) == Handled::stop ? Urgent::stop : Urgent::done;
        }
        const bool locked = (state.session.locked & static_cast<unsigned>(Lock::run)) != 0;
        const bool plain = !locked && !state.shell.collecting() && !state.shell.options.echo &&
                           !state.session.options().virtual_clock;
        const bool runs = std::string_view(verb.name) == "run";
        if (!runs || !plain || !is_stop(body["run"])) return Urgent::no;
    } catch (const RequestError&) {
        return Urgent::no;  // handle() reports it
    }
    state.halt_ticket = state.session.threads().halt();
    return halted(line, reply);
}

Connection::Urgent Connection::halted(std::string_view line, std::string& reply) {
    State& state = *state_;
    switch (state.session.threads().halted(state.halt_ticket)) {
    case ThreadControl::Halt::pending: return Urgent::halting;
    case ThreadControl::Halt::hung: return Urgent::lost;
    case ThreadControl::Halt::done: break;
    }
    state.session.event_log().note("command", "stop");
    ++state.requests;
    const std::string id = id_text(Json::parse(line.begin(), line.end(), nullptr, false));
    reply += "{\"id\":" + id + ",\"ok\":true,\"status\":0,\"out\":\"\",\"err\":\"\"}\n";
    return Urgent::done;
}

bool Connection::cancels(std::string_view line) {
    if (line.find("\"cancel\"") == line.npos || line.size() > 1000 || too_deep(line)) return false;
    const Json body = Json::parse(line.begin(), line.end(), nullptr, false);
    if (!body.is_object() || member(body, "cancel") != true) return false;
    cancel();
    return true;
}

void Connection::cancel(bool on) { state_->shell.cancel(on); }

std::int64_t Connection::next_due_ns() const {
    return std::min(state_->values.subscriptions.next_due_ns(), state_->probes.next_due_ns());
}

void Connection::publish(std::int64_t now_ns, bool congested, std::string& events) {
    state_->values.subscriptions.publish(state_->session, now_ns, congested, events);
    state_->probes.publish(now_ns, congested, events);
}

std::uint64_t Connection::requests() const { return state_->requests; }
std::uint64_t Connection::invalid_requests() const { return state_->invalid_requests; }

}  // namespace hal
