// SPDX-License-Identifier: MIT
#include "shell/protocol.hpp"

#include <algorithm>
#include <chrono>
#include <cstring>
#include <limits>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>
#include <unistd.h>

#include "paths.hpp"
#include "session/session.hpp"
#include "shell/commands.hpp"
#include "shell/describe.hpp"
#include "shell/processes.hpp"
#include "shell/program_requests.hpp"
#include "shell/request.hpp"
#include "shell/shell.hpp"
#include "shell/streams.hpp"

namespace hal {
namespace {

using Json = nlohmann::json;

constexpr int deepest = 16;  // brackets within brackets of a request
constexpr std::size_t most_subscriptions = 64;

/// Arrays and objects in each other, counted without building them: a hostile line costs one pass.
bool too_deep(std::string_view line) {
    int depth = 0;
    bool quoted = false;
    for (std::size_t i = 0; i < line.size(); ++i) {
        const char c = line[i];
        if (quoted) {
            if (c == '\\') ++i;
            else if (c == '"') quoted = false;
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

std::int64_t steady_ns() { return std::chrono::steady_clock::now().time_since_epoch() / std::chrono::nanoseconds(1); }

std::string dumped(const Json& value) { return value.dump(-1, ' ', false, Json::error_handler_t::replace); }

struct Subscription {
    std::uint64_t id;
    std::vector<std::string> names;
    std::int64_t every_ns, due_ns;
    bool changes_only;
    std::vector<std::optional<Reading>> last = {};
    std::uint64_t skipped = 0;
};

bool same(const std::vector<std::optional<Reading>>& a, const std::vector<std::optional<Reading>>& b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const auto& x, const auto& y) {
        if (!x || !y) return !x && !y;
        return x->type == y->type && visit(x->type, x->value, [&](const auto& member) {
            return visit(y->type, y->value, [&](const auto& other) {
                if constexpr (std::is_same_v<decltype(member), decltype(other)>) return std::memcmp(&member, &other, sizeof member) == 0;
                else return false;
            });
        });
    });
}

}  // namespace

struct Connection::State {
    State(Shell& main, pid_t client) : shell(main, {}), session(main.session()), peer(client) {}

    Shell shell;
    Session& session;
    pid_t peer;
    const std::uint64_t owner = shell.processes().new_owner();  ///< of the components that this client answers for
    std::vector<Subscription> subscriptions;
    std::uint64_t next_subscription = 1, requests = 0, rubbish = 0;
    std::map<std::string, std::string> environment;  ///< what $NAME is in the request being executed
    bool stop = false;

    // Each appends the members of its reply after "ok":true, beginning with a comma, or throws Refusal before anything.
    void run(const Json& body, std::string& reply);
    void script(const Json& body, std::string& reply);
    void options(const Json& body, std::string& reply);
    void read(const Json& body, std::string& reply);
    void set(const Json& body, std::string& reply);
    void subscribe(const Json& body, std::string& reply);
    void unsubscribe(const Json& body, std::string& reply);
    void list(const Json& body, std::string& reply);
    void describe_kind(const Json& body, std::string& reply);
    void complete(const Json& body, std::string& reply);
    void component(const Json& body, std::string& reply) { declare_component({shell, session, peer, owner}, body, reply); }
    void exchange(const Json& body, std::string& reply) { exchange_values({shell, session, peer, owner}, body, reply); }
    void exit(const Json& body, std::string&) { leave_component({shell, session, peer, owner}, body); }
    void port(const Json& body, std::string& reply) { use_port({shell, session, peer, owner}, body, reply); }
    void stream(const Json& body, std::string& reply);
    void end(const Json& body, std::string& reply);
    void nothing(const Json&, std::string&) {}

    void append_values(std::string& to, const std::vector<std::optional<Reading>>& readings) const;
    void execute(const Json& body, const std::string& text, bool script, std::string& reply);
};

namespace {

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
    {"list", &Connection::State::list, "patterns "},
    {"describe", &Connection::State::describe_kind, "patterns type "},
    {"complete", &Connection::State::complete, "cursor "},
    {"component", &Connection::State::component, "prefix pins ready timeout_ms "},
    {"exchange", &Connection::State::exchange, "write read "},
    {"exit", &Connection::State::exit, ""},
    {"port", &Connection::State::port, "read peek write "},
    {"stream", &Connection::State::stream, "take records create owner "},
    {"stop", &Connection::State::end, ""},
    {"cancel", &Connection::State::nothing, ""},
};

/// True when `word` is one of those in `words`, each followed by a blank.
bool listed_in(std::string_view words, std::string_view word) {
    for (std::size_t at = 0, blank; (blank = words.find(' ', at)) != words.npos; at = blank + 1)
        if (words.substr(at, blank - at) == word) return true;
    return false;
}

/// The one verb of a request; refuses what is not understood, so that a misspelt member is not silently without effect.
const Verb& verb_of(const Json& body) {
    const Verb* found = nullptr;
    for (auto entry = body.begin(); entry != body.end(); ++entry) {
        const auto verb = std::find_if(std::begin(verbs), std::end(verbs), [&](const Verb& v) { return entry.key() == v.name; });
        if (verb == std::end(verbs)) continue;
        if (found && listed_in(found->members, verb->name)) continue;  // read is a member of exchange, too
        if (found && !listed_in(verb->members, found->name))
            throw Refusal{std::string("a request has one verb, not both ") + found->name + " and " + verb->name};
        found = verb;
    }
    if (!found) {
        std::vector<std::string> names;
        for (const Verb& verb : verbs) names.emplace_back(verb.name);
        throw Refusal{"there is no verb in this request; the verbs are: " + listed(names, names.size())};
    }
    for (auto entry = body.begin(); entry != body.end(); ++entry) {
        const std::string& key = entry.key();
        if (key != "id" && key != found->name && !listed_in(found->members, key))
            throw Refusal{"'" + key.substr(0, 60) + "' is no member of a request to " + found->name};
    }
    return *found;
}

}  // namespace

// --- the verbs -----------------------------------------------------------------------------------------------------------

void Connection::State::run(const Json& body, std::string& reply) { execute(body, text_of(body["run"], "run"), false, reply); }

void Connection::State::script(const Json& body, std::string& reply) { execute(body, text_of(body["script"], "script"), true, reply); }

void Connection::State::execute(const Json& body, const std::string& text, bool script, std::string& reply) {
    const Json& name = member(body, "name");
    const Json& env = member(body, "env");
    if (!name.is_null()) text_of(name, "name");
    std::uint32_t number = 1;
    if (const Json& line = member(body, "line"); !line.is_null()) {
        if (!line.is_number_unsigned() || line.get<std::uint64_t>() - 1 > 4'000'000'000) throw Refusal{"line must be a number from 1"};
        number = line.get<std::uint32_t>();
    }
    if (!env.is_null()) {
        if (!env.is_object()) throw Refusal{"env must be an object of names and strings"};
        environment.clear();
        for (const auto& [key, value] : env.items()) environment[key] = text_of(value, "a value in env");
        shell.look_up([this](const std::string& key) -> std::optional<std::string> {
            const auto at = environment.find(key);
            return at == environment.end() ? std::nullopt : std::optional(at->second);
        });
    }
    TextOutput output;
    const std::string source = name.is_string() ? name.get<std::string>() : script ? "<stdin>" : "<shell>";
    const int status = script ? shell.run_text(source, text, output) : shell.execute(text, output, source, number);
    shell.look_up({});
    reply += ",\"status\":" + std::to_string(status) + ",\"out\":";
    json_quote(reply, output.out_text);
    json_quote(reply += ",\"err\":", output.err_text);
    if (shell.quit()) reply += ",\"quit\":true";
    if (shell.collecting()) reply += ",\"collecting\":true";
}

void Connection::State::options(const Json& body, std::string&) {
    static constexpr std::pair<const char*, bool ShellOptions::*> flags[] = {
        {"keep_going", &ShellOptions::keep_going}, {"echo", &ShellOptions::echo}, {"script", &ShellOptions::script},
        {"json", &ShellOptions::json}, {"color", &ShellOptions::color}, {"notes", &ShellOptions::notes}};
    static constexpr const char* levels[] = {"nothing", "errors", "results", "debug"};
    const Json& given = body["options"];
    if (!given.is_object()) throw Refusal{"options must be an object"};
    ShellOptions wanted = shell.options;
    for (const auto& [key, value] : given.items()) {
        const auto flag = std::find_if(std::begin(flags), std::end(flags), [&, k = key](const auto& f) { return k == f.first; });
        if (flag != std::end(flags)) {
            if (!value.is_boolean()) throw Refusal{key + " must be true or false"};
            wanted.*flag->second = value.get<bool>();
        } else if (key == "level") {
            const auto level = std::find(std::begin(levels), std::end(levels), text_of(value, "level"));
            if (level == std::end(levels)) throw Refusal{"level must be nothing, errors, results or debug"};
            wanted.level = static_cast<Level>(level - std::begin(levels));
        } else if (key == "directory") {
            wanted.directory = text_of(value, "directory");
        } else {
            throw Refusal{"there is no option '" + key.substr(0, 60) + "'"};
        }
    }
    shell.options = std::move(wanted);
}

void Connection::State::append_values(std::string& to, const std::vector<std::optional<Reading>>& readings) const {
    to += '[';
    for (const auto& reading : readings) {
        if (to.back() != '[') to += ',';
        if (reading) json_value(to, reading->type, reading->value);
        else to += "null";
    }
    to += ']';
}

void Connection::State::read(const Json& body, std::string& reply) {
    const auto names = names_in(body["read"], "read");
    const std::scoped_lock lock(session.mutex);
    const auto readings = session.read(names);
    append_values(reply += ",\"values\":", readings);
    reply += ",\"types\":[";
    for (const auto& reading : readings) {
        if (reply.back() != '[') reply += ',';
        reply += reading ? std::string("\"") + name(reading->type) + '"' : "null";
    }
    reply += "]";
}

void Connection::State::set(const Json& body, std::string& reply) {
    const Json& values = body["set"];
    if (!values.is_object()) throw Refusal{"set must be an object of names and values"};
    std::vector<Command> commands;
    for (const auto& [key, value] : values.items()) {
        const std::string word = value_word(value);
        if (word.empty()) throw Refusal{"the value of '" + key.substr(0, 60) + "' must be a number, true, false or a string"};
        commands.push_back({{"setp", {}}, {{key, {}}, {word, {}}}, {}});
    }
    const std::scoped_lock lock(session.mutex);
    Diagnostics diagnostics;
    for (Command& command : commands) {
        if (!session.model().find_pin(command.args[0].text) && session.model().find_signal(command.args[0].text))
            command.name.text = "sets";
        if (!check_lock(*find_command(command.name.text), command, session.lock, diagnostics)) break;
        session.apply(command, diagnostics);
    }
    if (!commands.empty() && session.in_transaction()) session.commit(diagnostics);
    if (diagnostics.failed()) throw Refusal{render(diagnostics, session.sources) + "nothing was changed"};
    reply += ",\"count\":" + std::to_string(commands.size());
}

void Connection::State::subscribe(const Json& body, std::string& reply) {
    auto names = names_in(body["subscribe"], "subscribe");
    const Json& every = member(body, "every_ms");
    const std::int64_t every_ms = every.is_null() ? 100 : whole(every, "every_ms", 1, 3'600'000);
    const Json& changes = member(body, "changes");
    if (!changes.is_null() && !changes.is_boolean()) throw Refusal{"changes must be true or false"};
    if (subscriptions.size() >= most_subscriptions)
        throw Refusal{"a client has at most " + std::to_string(most_subscriptions) + " subscriptions"};
    subscriptions.push_back(
        {next_subscription++, std::move(names), every_ms * 1'000'000, steady_ns(), changes.is_boolean() && changes.get<bool>()});
    reply += ",\"subscription\":" + std::to_string(subscriptions.back().id);
}

void Connection::State::unsubscribe(const Json& body, std::string&) {
    const auto id = static_cast<std::uint64_t>(whole(body["unsubscribe"], "unsubscribe", 1, std::numeric_limits<std::int64_t>::max()));
    if (std::erase_if(subscriptions, [&](const Subscription& s) { return s.id == id; }) == 0)
        throw Refusal{"there is no subscription " + std::to_string(id)};
}

namespace {

Listed kind_of(const Json& value, const char* verb) {
    const auto kind = listed_kind(text_of(value, verb));
    if (!kind) throw Refusal{std::string(verb) + " knows: comp, pin, sig, param, funct, thread, alias, all"};
    return *kind;
}

Patterns patterns_of(const Json& body) {
    const Json& patterns = member(body, "patterns");
    return patterns.is_null() ? Patterns{} : Patterns(names_in(patterns, "patterns"));
}

}  // namespace

void Connection::State::list(const Json& body, std::string& reply) {
    const Listed kind = kind_of(body["list"], "list");
    const Patterns patterns = patterns_of(body);
    const std::scoped_lock lock(session.mutex);
    reply += ",\"names\":[";
    for (const auto& name : names_of(session.model(), kind, patterns)) {
        if (reply.back() != '[') reply += ',';
        json_quote(reply, name);
    }
    reply += ']';
}

void Connection::State::describe_kind(const Json& body, std::string& reply) {
    const Listed kind = kind_of(body["describe"], "describe");
    const Patterns patterns = patterns_of(body);
    std::optional<hal_type> type;
    if (const Json& wanted = member(body, "type"); !wanted.is_null()) {
        type = type_named(text_of(wanted, "type"));
        if (!type) throw Refusal{"type must be bit, float, s32, u32, s64, u64 or port"};
    }
    const std::scoped_lock lock(session.mutex);
    describe(reply += ",\"objects\":", session, shell.processes(), kind, patterns, type);
}

void Connection::State::complete(const Json& body, std::string& reply) {
    const std::string& line = text_of(body["complete"], "complete");
    const Json& cursor = member(body, "cursor");
    const auto at =
        cursor.is_null() ? line.size() : static_cast<std::size_t>(whole(cursor, "cursor", 0, std::numeric_limits<std::int32_t>::max()));
    const Completion completion = shell.complete(line, at);
    reply += ",\"begin\":" + std::to_string(completion.begin) + ",\"candidates\":[";
    for (const Candidate& candidate : completion.candidates) {
        if (reply.back() != '[') reply += ',';
        json_quote(reply += "{\"text\":", candidate.text);
        if (!candidate.hint.empty()) json_quote(reply += ",\"hint\":", candidate.hint);
        reply += '}';
    }
    reply += ']';
}

void Connection::State::stream(const Json& body, std::string& reply) { use_stream({shell, session, peer, owner}, body, reply); }

void Connection::State::end(const Json&, std::string&) { stop = true; }

// --- the connection ------------------------------------------------------------------------------------------------------

Connection::Connection(Shell& shell, pid_t peer) : state_(new State(shell, peer)) {}

Connection::~Connection() {
    const std::scoped_lock lock(state_->session.mutex);
    state_->shell.processes().withdraw(state_->owner);
}

std::string Connection::hello() const {
    std::string line = "{\"halcyon\":1,\"name\":";
    json_quote(line, state_->session.options().name);
    json_quote(line += ",\"version\":", paths::version);
    return line + ",\"pid\":" + std::to_string(getpid()) + "}\n";
}

Connection::Handled Connection::handle(std::string_view line, std::string& replies, bool may_wait) {
    State& state = *state_;
    std::string id = "null";
    const auto refuse = [&](const std::string& sentence) {
        replies += "{\"id\":" + id + ",\"ok\":false,\"error\":";
        json_quote(replies, sentence);
        replies += "}\n";
        return Handled::done;
    };
    if (too_deep(line)) {
        ++state.rubbish;
        return refuse("more than " + std::to_string(deepest) + " brackets within each other");
    }
    const Json body = Json::parse(line.begin(), line.end(), nullptr, false);
    if (!body.is_object()) {
        ++state.rubbish;
        return refuse(body.is_discarded() ? "this is not JSON; a request is one JSON object in one line" : "a request is a JSON object");
    }
    if (const Json& given = member(body, "id");
        given.is_number() || (given.is_string() && given.get_ref<const std::string&>().size() <= 200))
        id = dumped(given);
    const std::size_t before = replies.size();
    try {
        const Verb& verb = verb_of(body);
        const bool script = verb.handle == &State::script;
        if (!may_wait && (verb.handle == &State::run || script)) {
            const Json& text = body[script ? "script" : "run"];
            if (text.is_string() && Shell::may_wait(text.get_ref<const std::string&>())) return Handled::wants_thread;
        }
        ++state.requests;
        replies += "{\"id\":" + id + ",\"ok\":true";
        (state.*verb.handle)(body, replies);
        replies += "}\n";
    } catch (const Refusal& refusal) {
        replies.resize(before);
        return refuse(refusal.sentence);
    } catch (const std::bad_alloc&) {
        replies.resize(before);
        return refuse("not enough memory for this request");
    }
    return std::exchange(state.stop, false) ? Handled::stop : Handled::done;
}

bool Connection::cancels(std::string_view line) {
    if (line.find("\"cancel\"") == line.npos || line.size() > 1000 || too_deep(line)) return false;
    const Json body = Json::parse(line.begin(), line.end(), nullptr, false);
    if (!body.is_object() || !body.contains("cancel")) return false;
    cancel();
    return true;
}

void Connection::cancel(bool on) { state_->shell.cancel(on); }

std::int64_t Connection::next_due_ns() const {
    std::int64_t due = std::numeric_limits<std::int64_t>::max();
    for (const Subscription& subscription : state_->subscriptions) due = std::min(due, subscription.due_ns);
    return due;
}

void Connection::publish(std::int64_t now_ns, bool congested, std::string& events) {
    for (Subscription& subscription : state_->subscriptions) {
        if (subscription.due_ns > now_ns) continue;
        const std::int64_t periods = (now_ns - subscription.due_ns) / subscription.every_ns + 1;  // the grid stays
        subscription.due_ns += periods * subscription.every_ns;
        if (congested) {
            ++subscription.skipped;
            continue;
        }
        std::vector<std::optional<Reading>> readings;
        std::int64_t time_ns = 0;
        {
            const std::scoped_lock lock(state_->session.mutex);
            readings = state_->session.read(subscription.names);
            time_ns = state_->session.now_ns();
        }
        if (subscription.changes_only && same(readings, subscription.last)) continue;
        events += "{\"event\":\"values\",\"subscription\":" + std::to_string(subscription.id) + ",\"time_ns\":" + std::to_string(time_ns) +
                  ",\"values\":";
        state_->append_values(events, readings);
        if (subscription.skipped > 0) events += ",\"skipped\":" + std::to_string(std::exchange(subscription.skipped, 0));
        events += "}\n";
        subscription.last = std::move(readings);
    }
}

std::uint64_t Connection::requests() const { return state_->requests; }
std::uint64_t Connection::rubbish() const { return state_->rubbish; }

}  // namespace hal
