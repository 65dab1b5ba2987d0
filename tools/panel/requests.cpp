// SPDX-License-Identifier: MIT
#include "panel/requests.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <string_view>

#include "text/typed_command.hpp"

namespace hal::tools {

namespace {

using Json = nlohmann::json;

constexpr std::int64_t min_period_ms = 10;

struct Verb {
    std::string_view name;
    RequestKind kind;
    std::initializer_list<std::string_view> members;  ///< besides id
};

const Verb verbs[] = {
    {"read", RequestKind::reads, {}},
    {"subscribe", RequestKind::reads, {"every_ms", "changes"}},
    {"unsubscribe", RequestKind::reads, {}},
    {"list", RequestKind::reads, {"patterns"}},
    {"describe", RequestKind::reads, {"patterns", "type", "histograms"}},
    {"complete", RequestKind::reads, {"cursor"}},
    {"probe", RequestKind::reads, {"every", "batch_ms", "buffer_ms"}},
    {"unprobe", RequestKind::reads, {}},
    {"run", RequestKind::reads, {}},
    {"moment", RequestKind::reads, {}},
    {"around", RequestKind::reads, {"before_ms", "after_ms"}},
    {"set", RequestKind::writes, {}},
};

/// What moves a replayed machine; one that runs has no such commands.
bool moves_in_time(const Json& words) {
    constexpr std::string_view moves[] = {"step", "back",  "continue", "reverse",
                                          "goto", "break", "where",    "pause"};
    if (words == Json{"fault", "next"} || words == Json{"fault", "previous"}) return true;
    return std::find(std::begin(moves), std::end(moves), words[0].get_ref<const std::string&>()) !=
           std::end(moves);
}

/// Of the command language a page may use what only reads, what moves a replayed machine, and the
/// acknowledgement of faults.
RequestKind check_command(const Json& words) {
    if (!words.is_array() || words.empty() || words.size() > 8) return RequestKind::rejected;
    if (!std::all_of(words.begin(), words.end(),
                     [](const Json& word) { return word.is_string(); })) {
        return RequestKind::rejected;
    }
    if (words == Json{"fault", "clear"}) return RequestKind::writes;
    if (moves_in_time(words)) return RequestKind::reads;
    return words[0] == "show" || words[0] == "status" ? RequestKind::reads : RequestKind::rejected;
}

}  // namespace

RequestKind check_request(Json& request, std::string& problem) {
    const Verb* verb = nullptr;
    for (const Verb& row : verbs) {
        if (request.contains(row.name)) {
            verb = verb ? nullptr : &row;
        }
    }
    if (!verb) {
        problem =
            "a request has exactly one of the verbs read, subscribe, unsubscribe, list, describe, "
            "complete, probe, unprobe, run, moment, around, set";
        return RequestKind::rejected;
    }
    for (const auto& [key, value] : request.items()) {
        if (key == verb->name ||
            std::find(verb->members.begin(), verb->members.end(), key) != verb->members.end()) {
            continue;
        }
        if (key == "id" && value.is_number_unsigned()) continue;
        problem = "'" + key.substr(0, 60) + "' is not a valid member of a request to " +
                  std::string(verb->name);
        return RequestKind::rejected;
    }
    RequestKind kind = verb->kind;
    if (verb->name == "run") {
        kind = check_command(request["run"]);
        if (kind == RequestKind::rejected) {
            problem = as_typed("this command is not available in the panel; type: hal shell");
        }
    }
    for (const char* const period : {"every_ms", "batch_ms"}) {
        if (request.contains(period) && request[period].is_number_integer()) {
            request[period] = std::max(request[period].get<std::int64_t>(), min_period_ms);
        }
    }
    return kind;
}

}  // namespace hal::tools
