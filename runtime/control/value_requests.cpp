// SPDX-License-Identifier: MIT
#include "control/value_requests.hpp"

#include <limits>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include "commands/describe.hpp"
#include "commands/json_text.hpp"
#include "commands/table.hpp"
#include "control/request.hpp"
#include "machine/report/logged_edits.hpp"

namespace hal {
namespace {

using Json = nlohmann::json;

}  // namespace

void ValueRequests::read(const Json& body, std::string& reply) {
    const auto names = names_in(body["read"], "read");
    const auto lock = session_.lock();
    const auto readings = session_.values().read(names);
    append_values(reply += ",\"values\":", readings);
    reply += ",\"types\":[";
    for (const auto& reading : readings) {
        if (reply.back() != '[') {
            reply += ',';
        }
        reply += reading ? std::string("\"") + name(reading->type) + '"' : "null";
    }
    reply += "]";
}

void ValueRequests::set(const Json& body, std::string& reply) {
    const Json& values = body["set"];
    if (!values.is_object()) {
        throw RequestError{"set must be an object of names and values"};
    }
    std::vector<Command> commands;
    for (const auto& [key, value] : values.items()) {
        const std::string word = value_word(value);
        if (word.empty()) {
            throw RequestError{"the value of '" + key.substr(0, 60) +
                               "' must be a number, true, false or a string"};
        }
        commands.push_back({{"setp", {}}, {{key, {}}, {word, {}}}, {}});
    }
    if (shell_.collecting()) {  // part of what `commit` makes take effect
        shell_.collect(commands);
        reply += ",\"count\":" + std::to_string(commands.size()) + ",\"collecting\":true";
        return;
    }
    const auto lock = session_.lock();
    Diagnostics diagnostics;
    LoggedEdits logged(session_.event_log());
    Transaction transaction = session_.begin();
    for (Command& command : commands) {
        resolve_set(session_.model(), command);
        const CommandRow& row = *find_command(command.name.text);
        logged.add(command.name.text + " " + command.args[0].text + " " + command.args[1].text);
        if (!check_lock(row, command, session_.locked, session_.model(), diagnostics)) break;
        transaction.apply(row.form(), command, diagnostics);
    }
    const bool took_effect = transaction.commit(diagnostics);
    logged.finish(diagnostics, !took_effect);
    if (!took_effect) {
        throw RequestError{render(diagnostics, session_.sources) + "nothing was changed"};
    }
    reply += ",\"count\":" + std::to_string(commands.size());
}

void ValueRequests::subscribe(const Json& body, std::string& reply) {
    auto names = names_in(body["subscribe"], "subscribe");
    const Json& every = member(body, "every_ms");
    const std::int64_t every_ms = every.is_null() ? 100 : whole(every, "every_ms", 1, 3'600'000);
    const Json& changes = member(body, "changes");
    if (!changes.is_null() && !changes.is_boolean()) {
        throw RequestError{"changes must be true or false"};
    }
    const std::uint64_t number = subscriptions.add(std::move(names), every_ms * 1'000'000,
                                                   changes.is_boolean() && changes.get<bool>());
    if (number == 0) {
        throw RequestError{"a client has at most " + std::to_string(Subscriptions::max) +
                           " subscriptions"};
    }
    reply += ",\"subscription\":" + std::to_string(number);
}

void ValueRequests::unsubscribe(const Json& body) {
    const auto id = static_cast<std::uint64_t>(
        whole(body["unsubscribe"], "unsubscribe", 1, std::numeric_limits<std::int64_t>::max()));
    if (!subscriptions.remove(id)) {
        throw RequestError{"unknown subscription " + std::to_string(id)};
    }
}

namespace {

Listed kind_of(const Json& value, const char* verb) {
    const auto kind = listed_kind(text_of(value, verb));
    if (!kind) {
        throw RequestError{std::string(verb) +
                           " must be one of comp, pin, sig, param, funct, thread, alias, all"};
    }
    return *kind;
}

Patterns patterns_of(const Json& body) {
    const Json& patterns = member(body, "patterns");
    return patterns.is_null() ? Patterns{} : Patterns(names_in(patterns, "patterns"));
}

}  // namespace

void ValueRequests::list(const Json& body, std::string& reply) {
    const Listed kind = kind_of(body["list"], "list");
    const Patterns patterns = patterns_of(body);
    const auto lock = session_.lock();
    reply += ",\"names\":[";
    for (const auto& name : names_of(session_, kind, patterns)) {
        if (reply.back() != '[') {
            reply += ',';
        }
        json_quote(reply, name);
    }
    reply += ']';
}

void ValueRequests::describe(const Json& body, std::string& reply) {
    const Listed kind = kind_of(body["describe"], "describe");
    const Patterns patterns = patterns_of(body);
    std::optional<hal_type> type;
    if (const Json& wanted = member(body, "type"); !wanted.is_null()) {
        type = type_named(text_of(wanted, "type"));
        if (!type) {
            throw RequestError{"type must be bit, float, s32, u32, s64, u64 or port"};
        }
    }
    const Json& histograms = member(body, "histograms");
    if (!histograms.is_null() && !(histograms.is_boolean() && kind == Listed::threads)) {
        throw RequestError{
            "histograms must be true or false, and is a member of a request to describe threads"};
    }
    const auto lock = session_.lock();
    hal::describe(reply += ",\"objects\":", session_, kind, patterns, type);
    if (!histograms.is_boolean() || !histograms.get<bool>()) return;
    auto all = nlohmann::ordered_json::object();
    for (const auto& thread : session_.model().threads) {
        const ThreadHistograms one = session_.reports().histograms(*thread);
        all[thread->name] = {{"wakeup", one.wakeup}, {"busy", one.busy}};
    }
    reply += ",\"histograms\":" + json_text(all);
}

}  // namespace hal
