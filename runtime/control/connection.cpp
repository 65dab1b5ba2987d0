// SPDX-License-Identifier: MIT
#include "control/connection.hpp"

#include <algorithm>
#include <utility>
#include <vector>

#include <unistd.h>

#include "commands/json_text.hpp"
#include "control/connection_state.hpp"
#include "paths.hpp"

namespace hal {
namespace {

constexpr int deepest = 16;  // brackets within brackets of a request

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
            if (++depth > deepest) return true;
        } else if (c == ']' || c == '}') {
            --depth;
        }
    }
    return false;
}

std::string dumped(const Json& value) {
    return value.dump(-1, ' ', false, Json::error_handler_t::replace);
}

struct Verb {
    const char* name;
    void (Connection::State::*handle)(const Json&, std::string&);
    const char* members;  ///< beside the verb itself and id, each followed by a blank
};

constexpr Verb verbs[] = {
    {"run", &Connection::State::run, "name line env "},
    {"script", &Connection::State::script, "name env "},
    {"options", &Connection::State::options, ""},
    {"read", &Connection::State::read, ""},
    {"set", &Connection::State::set, ""},
    {"subscribe", &Connection::State::subscribe, "every_ms changes "},
    {"unsubscribe", &Connection::State::unsubscribe, ""},
    {"probe", &Connection::State::probe, "every batch_ms buffer_ms "},
    {"unprobe", &Connection::State::unprobe, ""},
    {"journal", &Connection::State::journal, ""},
    {"trace", &Connection::State::trace, ""},
    {"list", &Connection::State::list, "patterns "},
    {"describe", &Connection::State::describe_kind, "patterns type histograms "},
    {"complete", &Connection::State::complete, "cursor "},
    {"component", &Connection::State::component, "prefix pins ready timeout_ms every_ms safe "},
    {"exchange", &Connection::State::exchange, "write read alive "},
    {"exit", &Connection::State::exit, ""},
    {"port", &Connection::State::port, "read peek write "},
    {"stream", &Connection::State::stream, "take records create owner "},
    {"stop", &Connection::State::end, ""},
    {"cancel", &Connection::State::cancelled, ""},
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
    state_->event = std::move(take);
}

bool Connection::idle() const {
    if (state_->engaged || !state_->subscriptions.empty() || !state_->probes.empty() ||
        state_->traces.on()) {
        return false;
    }
    if (!state_->has_component) return true;
    const auto lock = state_->session.try_lock();
    if (!lock || state_->session.programs().answers(state_->owner)) return false;
    state_->has_component = false;
    return true;
}

std::string Connection::hello() const {
    return json_text({{"halcyon", 1},
                      {"name", state_->session.options().name},
                      {"version", paths::version},
                      {"pid", getpid()}}) +
           "\n";
}

Connection::Handled Connection::handle(std::string_view line, std::string& replies, bool may_wait) {
    State& state = *state_;
    const State::Engaged engaged(state);
    std::string id = "null";
    const auto refuse = [&](const std::string& sentence) {
        replies += "{\"id\":" + id + ",\"ok\":false,\"error\":";
        json_quote(replies, sentence);
        replies += "}\n";
        return Handled::done;
    };
    if (too_deep(line)) {
        ++state.rubbish;
        return refuse("more than " + std::to_string(deepest) + " nested brackets");
    }
    const Json body = Json::parse(line.begin(), line.end(), nullptr, false);
    if (!body.is_object()) {
        ++state.rubbish;
        return refuse(body.is_discarded() ? "invalid JSON; a request is one JSON object on one line"
                                          : "a request is a JSON object");
    }
    if (const Json& given = member(body, "id");
        given.is_number() ||
        (given.is_string() && given.get_ref<const std::string&>().size() <= 200)) {
        id = dumped(given);
    }
    const auto refuse_at_end = [&] {
        state.told_end = true;
        return refuse("the machine ends");
    };
    const std::size_t before = replies.size();
    try {
        const Verb& verb = verb_of(body);
        // A program's values go on until the connection is closed, which is what it takes for the
        // end of the machine.
        constexpr decltype(verb.handle) until_closed[] = {
            &State::end, &State::exchange, &State::exit, &State::port, &State::stream};
        const bool answered = std::find(std::begin(until_closed), std::end(until_closed),
                                        verb.handle) != std::end(until_closed);
        if (state.session.ending() && !answered) return refuse_at_end();
        const bool script = verb.handle == &State::script;
        if (!may_wait && (verb.handle == &State::run || script)) {
            const Json& text = body[script ? "script" : "run"];
            if (text.is_string() && Shell::may_wait(text.get_ref<const std::string&>())) {
                return Handled::wants_thread;
            }
            if (text.is_array() && !text.empty() && text[0].is_string() &&
                Shell::may_wait(text[0].get_ref<const std::string&>())) {
                return Handled::wants_thread;
            }
        }
        ++state.requests;
        replies += "{\"id\":" + id + ",\"ok\":true";
        (state.*verb.handle)(body, replies);
        const bool looks = verb.handle == &State::describe_kind || verb.handle == &State::list;
        if (looks && state.session.ending()) {  // it may have been abandoned halfway
            replies.resize(before);
            return refuse_at_end();
        }
        replies += "}\n";
    } catch (const RequestError& refusal) {
        replies.resize(before);
        return refuse(refusal.sentence);
    } catch (const std::bad_alloc&) {
        replies.resize(before);
        return refuse("not enough memory for this request");
    }
    return std::exchange(state.stop, false) ? Handled::stop : Handled::done;
}

namespace {

constexpr std::size_t longest_urgent = std::size_t{64} << 10;

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
    if (line.size() > longest_urgent || (!stops && line.find("\"options\"") == line.npos) ||
        too_deep(line)) {
        return Urgent::no;
    }
    const Json body = Json::parse(line.begin(), line.end(), nullptr, false);
    if (!body.is_object()) return Urgent::no;
    try {
        const auto handle = verb_of(body).handle;
        if (handle == &State::options || handle == &State::end) {
            return this->handle(line, reply) == Handled::stop ? Urgent::stop : Urgent::done;
        }
        const bool locked = (state.session.locked & static_cast<unsigned>(Lock::run)) != 0;
        const bool plain = !locked && !state.shell.collecting() && !state.shell.options.echo &&
                           !state.session.options().virtual_clock;
        if (handle != &State::run || !plain || !is_stop(body["run"])) return Urgent::no;
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
    state.session.journal().note("command", "stop");
    ++state.requests;
    const Json id = Json::parse(line.begin(), line.end(), nullptr, false).value("id", Json());
    const bool echoed =
        id.is_number() || (id.is_string() && id.get_ref<const std::string&>().size() <= 200);
    reply += "{\"id\":" + (echoed ? dumped(id) : "null") +
             ",\"ok\":true,\"status\":0,\"out\":\"\",\"err\":\"\"}\n";
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
    return std::min({state_->subscriptions.next_due_ns(), state_->probes.next_due_ns(),
                     state_->traces.next_due_ns()});
}

void Connection::publish(std::int64_t now_ns, bool congested, std::string& events) {
    state_->subscriptions.publish(state_->session, now_ns, congested, events);
    state_->probes.publish(now_ns, congested, events);
    state_->traces.publish(now_ns, congested, events);
}

std::uint64_t Connection::requests() const { return state_->requests; }
std::uint64_t Connection::rubbish() const { return state_->rubbish; }

}  // namespace hal
