// SPDX-License-Identifier: MIT
#include "control/command_requests.hpp"

#include <algorithm>
#include <limits>
#include <optional>
#include <utility>

#include "commands/describe.hpp"
#include "commands/json_text.hpp"
#include "control/request.hpp"
#include "netlist/netlist.hpp"

namespace hal {
namespace {

using Json = nlohmann::json;

/// What a command prints; what it reports while it waits goes to the client at once.
class Reply final : public Output {
public:
    explicit Reply(const std::function<void(std::string)>& event) : event_(event) {}
    void out(std::string_view text) override { out_text += text; }
    void err(std::string_view text) override { err_text += text; }
    void notice(std::string_view text) override {
        if (!event_) return err(text);
        event_(json_text({{"event", "notice"}, {"text", text}}) + "\n");
    }
    std::string out_text, err_text;

private:
    const std::function<void(std::string)>& event_;
};

void append_answer(int status, const Shell& shell, const Reply& output, std::string& reply) {
    reply += ",\"status\":" + std::to_string(status) + ",\"out\":";
    json_quote(reply, output.out_text);
    json_quote(reply += ",\"err\":", output.err_text);
    if (shell.quit()) {
        reply += ",\"quit\":true";
    }
    if (shell.collecting()) {
        reply += ",\"collecting\":true";
    }
}

}  // namespace

void CommandRequests::run(const Json& body, std::string& reply) {
    if (!body["run"].is_array()) return execute(body, text_of(body["run"], "run"), false, reply);
    const auto words = names_in(body["run"], "run");
    if (words.empty()) {
        throw RequestError{"run requires a command: a line, or its words"};
    }
    const Json& name = member(body, "name");
    Reply output(event);
    const int status =
        shell_.execute(words, output, name.is_null() ? "<commandline>" : text_of(name, "name"));
    append_answer(status, shell_, output, reply);
}

void CommandRequests::script(const Json& body, std::string& reply) {
    execute(body, text_of(body["script"], "script"), true, reply);
}

/// Reads the number of the line, 1 when it is not given.
static std::uint32_t line_number(const Json& line) {
    if (line.is_null()) return 1;
    if (!line.is_number_unsigned() || line.get<std::uint64_t>() - 1 > 4'000'000'000) {
        throw RequestError{"line must be a number, 1 or more"};
    }
    return line.get<std::uint32_t>();
}

/// Makes $NAME in the request the variable of the client.
void CommandRequests::look_up(const Json& variables) {
    if (variables.is_null()) return;
    if (!variables.is_object()) {
        throw RequestError{"env must be an object of names and strings"};
    }
    environment_.clear();
    for (const auto& [key, value] : variables.items()) {
        environment_[key] = text_of(value, "a value in env");
    }
    shell_.look_up([this](const std::string& key) -> std::optional<std::string> {
        const auto at = environment_.find(key);
        return at == environment_.end() ? std::nullopt : std::optional(at->second);
    });
}

void CommandRequests::execute(const Json& body, const std::string& text, bool script,
                              std::string& reply) {
    const Json& name = member(body, "name");
    std::string source = script ? "<stdin>" : "<shell>";
    if (!name.is_null()) {
        source = text_of(name, "name");
    }
    const std::uint32_t number = line_number(member(body, "line"));
    look_up(member(body, "env"));
    Reply output(event);
    const int status = script ? shell_.run_text(source, text, output)
                              : shell_.execute(text, output, source, number);
    shell_.look_up({});
    append_answer(status, shell_, output, reply);
}

namespace {

/// The entries of a client's INI file: [SECTION, KEY, VALUE] each.
Ini ini_of(const Json& entries) {
    Ini ini;
    if (!entries.is_array()) {
        throw RequestError{
            "ini must be a list of [SECTION, KEY, VALUE] or [SECTION, KEY, VALUE, PLACE]"};
    }
    for (const Json& entry : entries) {
        if (!entry.is_array() || entry.size() < 3 || entry.size() > 4) {
            throw RequestError{
                "an entry of ini must be [SECTION, KEY, VALUE] or [SECTION, KEY, VALUE, PLACE]"};
        }
        std::string location = entry.size() == 4 ? text_of(entry[3], "a place") : std::string();
        ini.add({text_of(entry[0], "a section"),
                 text_of(entry[1], "a key"),
                 text_of(entry[2], "a value"),
                 {},
                 std::move(location)});
    }
    return ini;
}

}  // namespace

void CommandRequests::options(const Json& body) {
    static constexpr std::pair<const char*, bool ShellOptions::*> flags[] = {
        {"keep_going", &ShellOptions::keep_going}, {"echo", &ShellOptions::echo},
        {"script", &ShellOptions::script},         {"json", &ShellOptions::json},
        {"color", &ShellOptions::color},           {"notes", &ShellOptions::notes}};
    static constexpr const char* levels[] = {"nothing", "errors", "results", "debug"};
    const Json& given = body["options"];
    if (!given.is_object()) {
        throw RequestError{"options must be an object"};
    }
    ShellOptions wanted = shell_.options;
    std::optional<Ini> ini;
    for (const auto& [key, value] : given.items()) {
        const auto flag = std::find_if(std::begin(flags), std::end(flags),
                                       [&, k = key](const auto& f) { return k == f.first; });
        if (flag != std::end(flags)) {
            if (!value.is_boolean()) {
                throw RequestError{key + " must be true or false"};
            }
            wanted.*flag->second = value.get<bool>();
        } else if (key == "level") {
            const auto level =
                std::find(std::begin(levels), std::end(levels), text_of(value, "level"));
            if (level == std::end(levels)) {
                throw RequestError{"level must be nothing, errors, results or debug"};
            }
            wanted.level = static_cast<Level>(level - std::begin(levels));
        } else if (key == "directory") {
            wanted.directory = text_of(value, "directory");
        } else if (key == "ini") {
            ini = ini_of(value);
        } else {
            throw RequestError{"unknown option '" + key.substr(0, 60) + "'"};
        }
    }
    shell_.options = std::move(wanted);
    if (ini) {
        shell_.look_in(std::move(ini));
    }
}

void CommandRequests::complete(const Json& body, std::string& reply) {
    const std::string& line = text_of(body["complete"], "complete");
    const Json& cursor = member(body, "cursor");
    const auto at = cursor.is_null()
                        ? line.size()
                        : static_cast<std::size_t>(
                              whole(cursor, "cursor", 0, std::numeric_limits<std::int32_t>::max()));
    const Completion completion = shell_.complete(line, at);
    auto candidates = nlohmann::ordered_json::array();
    for (const Candidate& candidate : completion.candidates) {
        auto& row = candidates.emplace_back(nlohmann::ordered_json{{"text", candidate.text}});
        if (!candidate.hint.empty()) {
            row["hint"] = candidate.hint;
        }
    }
    reply += ",\"begin\":" + std::to_string(completion.begin) +
             ",\"candidates\":" + json_text(candidates);
}

}  // namespace hal
