// SPDX-License-Identifier: MIT
#include "lsp/language_server.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include "paths.hpp"

namespace hal::tools {

using protocol::ErrorCode;
using protocol::RequestError;
using protocol::text_at;

namespace {

constexpr int incremental_sync = 2;  // TextDocumentSyncKind.Incremental
constexpr int refresh_ms = 100;  // values beside the lines are not older
constexpr std::size_t max_diagnostics = 1000;  // of one file

/// Returns the text of a message; what is not valid UTF-8, because a file on the disk is not, is
/// replaced.
std::string dumped(const protocol::Json& message) {
    return message.dump(-1, ' ', false, protocol::Json::error_handler_t::replace);
}

}  // namespace

const LanguageServer::Request LanguageServer::requests[] = {
    {"initialize", &LanguageServer::initialize},
    {"shutdown", &LanguageServer::shutdown},
    {"workspace/executeCommand", &LanguageServer::execute_command},
};

const LanguageServer::Feature LanguageServer::features[] = {
    {"textDocument/completion", &LanguageFeatures::completion},
    {"textDocument/hover", &LanguageFeatures::hover},
    {"textDocument/definition", &LanguageFeatures::definition},
    {"textDocument/references", &LanguageFeatures::references},
    {"textDocument/documentHighlight", &LanguageFeatures::highlights},
    {"textDocument/documentSymbol", &LanguageFeatures::symbols},
    {"textDocument/prepareRename", &LanguageFeatures::prepare_rename},
    {"textDocument/rename", &LanguageFeatures::rename},
    {"textDocument/codeAction", &LanguageFeatures::code_actions},
    {"textDocument/semanticTokens/full", &LanguageFeatures::all_tokens},
    {"textDocument/semanticTokens/range", &LanguageFeatures::tokens_of_range},
    {"textDocument/formatting", &LanguageFeatures::formatting},
    {"textDocument/inlayHint", &LanguageFeatures::inlay_hints},
};

const LanguageServer::Notification LanguageServer::notifications[] = {
    {"initialized", &LanguageServer::ignore},
    {"exit", &LanguageServer::end},
    {"textDocument/didOpen", &LanguageServer::opened},
    {"textDocument/didChange", &LanguageServer::changed},
    {"textDocument/didSave", &LanguageServer::saved},
    {"textDocument/didClose", &LanguageServer::closed},
    {"workspace/didChangeWatchedFiles", &LanguageServer::saved},
    {"workspace/didChangeConfiguration", &LanguageServer::configured},
};

LanguageServer::LanguageServer(Settings settings, Send send)
    : settings_(std::move(settings)), send_(std::move(send)) {
    if (!settings_.ini.empty()) {
        workspace_.set_ini(settings_.ini);
    }
    workspace_.set_assumed(settings_.assumed);
    machine_.set_name(settings_.machine);
}

void LanguageServer::handle(std::string_view body) {
    const Json message = Json::parse(body, nullptr, false);
    if (message.is_discarded()) {
        return send_error(nullptr, ErrorCode::parse_error, "the body is not valid JSON");
    }
    if (!message.is_object()) {
        return send_error(nullptr, ErrorCode::invalid_request, "a message is a JSON object");
    }
    handle_message(message);
}

void LanguageServer::handle_message(const Json& message) {
    const Json& id = protocol::member(message, "id");
    const std::string method = text_at(message, "method");
    const Json& params = protocol::member(message, "params");
    if (method.empty()) {
        const bool is_reply = message.contains("result") || message.contains("error");
        if (!is_reply) {
            send_error(id, ErrorCode::invalid_request, "missing method");
        }
        return;
    }
    if (!id.is_null()) return answer(id, method, params);
    const auto* const row =
        std::find_if(std::begin(notifications), std::end(notifications),
                     [&](const Notification& one) { return method == one.method; });
    if (row == std::end(notifications)) return;
    if (state_ == State::created && method != "exit") return;
    try {
        (this->*row->handle)(params);
    } catch (const RequestError&) {  // a notification has no answer
    }
}

void LanguageServer::answer(const Json& id, const std::string& method, const Json& params) {
    try {
        send({{"jsonrpc", "2.0"}, {"id", id}, {"result", result_of(method, params)}});
    } catch (const RequestError& error) {
        send_error(id, error.code, error.what());
    }
}

LanguageServer::Json LanguageServer::result_of(const std::string& method, const Json& params) {
    const auto is_method = [&](const auto& row) { return method == row.method; };
    const auto* const request = std::find_if(std::begin(requests), std::end(requests), is_method);
    const auto* const feature = std::find_if(std::begin(features), std::end(features), is_method);
    if (request == std::end(requests) && feature == std::end(features)) {
        throw RequestError(ErrorCode::method_not_found, "unsupported method '" + method + "'");
    }
    const bool is_initialize = method == "initialize";
    if (state_ == State::created && !is_initialize) {
        throw RequestError(ErrorCode::server_not_initialized, "the first request is initialize");
    }
    if (shut_down_ || (state_ == State::initialized && is_initialize)) {
        throw RequestError(ErrorCode::invalid_request,
                           "'" + method + "' is not allowed in this state");
    }
    if (request != std::end(requests)) return (this->*request->answer)(params);
    // the diagnostics of the newest text do not wait for the answer
    if (unpublished_ && workspace_.netlist_of(features_.path_of(params))) {
        publish();
    }
    return (features_.*feature->answer)(params);
}

void LanguageServer::send(const Json& message) { send_(dumped(message)); }

void LanguageServer::send_error(const Json& id, ErrorCode code, const std::string& text) {
    send({{"jsonrpc", "2.0"},
          {"id", id},
          {"error", {{"code", static_cast<int>(code)}, {"message", text}}}});
}

void LanguageServer::notify(const char* method, Json params) {
    send({{"jsonrpc", "2.0"}, {"method", method}, {"params", std::move(params)}});
}

int LanguageServer::idle_ms() const {
    const bool has_work = unpublished_ || workspace_.has_work() || workspace_.has_garbage();
    if (has_work) return 0;
    return can_refresh_hints_ && features_.has_hints() ? refresh_ms : -1;
}

void LanguageServer::work() {
    if (unpublished_ || workspace_.has_work()) {
        workspace_.work();
        publish();
    } else if (workspace_.has_garbage()) {
        workspace_.free_garbage();
    } else {
        refresh_hints();
    }
}

/// Asks the client to request the values beside the lines again, when they have changed.
void LanguageServer::refresh_hints() {
    if (!can_refresh_hints_ || !features_.hints_have_changed()) return;
    send({{"jsonrpc", "2.0"},
          {"id", "refresh-" + std::to_string(++refreshes_)},
          {"method", "workspace/inlayHint/refresh"}});
}

/// Runs a command and shows its result to the user.
LanguageServer::Json LanguageServer::execute_command(const Json& params) {
    constexpr int error = 1;  // MessageType of Language Server Protocol 3.17
    constexpr int info = 3;
    Json result = features_.execute_command(params);
    notify("window/showMessage", {{"type", result["applied"].get<bool>() ? info : error},
                                  {"message", result["message"]}});
    return result;
}

/// Sends the diagnostics of each file for which they have changed.
void LanguageServer::publish() {
    unpublished_ = workspace_.has_work();
    const auto uri_of = [this](const std::string& path) { return workspace_.uri_of(path); };
    std::map<std::string, std::string> messages;
    for (const auto& [uri, message] : published_) {
        messages[uri] = "";
    }
    for (const auto& [path, diagnostics] : workspace_.diagnostics()) {
        Json all = Json::array();
        for (const FileDiagnostic& finding : diagnostics) {
            if (all.size() == max_diagnostics) break;
            all.push_back(protocol::to_json(finding, uri_of));
        }
        Json params{{"uri", uri_of(path)}, {"diagnostics", std::move(all)}};
        const auto document = workspace_.documents().find(path);
        if (document != workspace_.documents().end()) {
            params["version"] = document->second.version;
        }
        messages[uri_of(path)] = dumped(params);
    }
    for (auto& [uri, message] : messages) {
        if (message.empty()) {
            notify("textDocument/publishDiagnostics",
                   {{"uri", uri}, {"diagnostics", Json::array()}});
            published_.erase(uri);
        } else if (published_[uri] != message) {
            notify("textDocument/publishDiagnostics", Json::parse(message));
            published_[uri] = std::move(message);
        }
    }
}

LanguageServer::Json LanguageServer::initialize(const Json& params) {
    state_ = State::initialized;
    const Json& refresh =
        protocol::member(params, "capabilities/workspace/inlayHint/refreshSupport");
    can_refresh_hints_ = refresh.is_boolean() && refresh.get<bool>();
    configured({{"settings", protocol::member(params, "initializationOptions")}});
    Json capabilities = LanguageFeatures::capabilities();
    capabilities["positionEncoding"] = "utf-16";
    capabilities["textDocumentSync"] = {
        {"openClose", true}, {"change", incremental_sync}, {"save", {{"includeText", false}}}};
    return {{"serverInfo", {{"name", "hal lsp"}, {"version", paths::version}}},
            {"capabilities", std::move(capabilities)}};
}

LanguageServer::Json LanguageServer::shutdown(const Json&) {
    shut_down_ = true;
    return nullptr;
}

void LanguageServer::ignore(const Json&) {}

void LanguageServer::end(const Json&) { state_ = State::ended; }

void LanguageServer::opened(const Json& params) {
    const Json& document = protocol::member(params, "textDocument");
    workspace_.open(text_at(document, "uri"), protocol::integer_at(document, "version", 0),
                    text_at(document, "text"));
    unpublished_ = true;
}

void LanguageServer::changed(const Json& params) {
    const Json& changes = protocol::member(params, "contentChanges");
    if (!changes.is_array()) {
        throw RequestError(ErrorCode::invalid_params, "contentChanges is not an array");
    }
    const auto edit = [&](TextDocument& text) {
        for (const Json& change : changes) {
            const std::string replacement = text_at(change, "text");
            if (protocol::member(change, "range").is_object()) {
                text.replace(protocol::range_at(change, "range"), replacement);
            } else {
                text = TextDocument(replacement);
            }
        }
    };
    workspace_.change(text_at(params, "textDocument/uri"),
                      protocol::integer_at(params, "textDocument/version", 0), edit);
    unpublished_ = true;
}

void LanguageServer::saved(const Json&) { workspace_.refresh(); }

void LanguageServer::closed(const Json& params) {
    workspace_.close(text_at(params, "textDocument/uri"));
    publish();
}

/// {"settings":{"ini":FILE,"assume":[NAME],"machine":NAME}}, also within "halcyon", as VS Code nests them.
void LanguageServer::configured(const Json& params) {
    const Json& all = protocol::member(params, "settings");
    const Json& nested = protocol::member(all, "halcyon");
    const Json& own = nested.is_object() ? nested : all;
    const Json& ini = protocol::member(own, "ini");
    if (ini.is_string() && ini.get<std::string>() != settings_.ini) {
        settings_.ini = ini.get<std::string>();
        workspace_.set_ini(settings_.ini);
    }
    if (const Json& names = protocol::member(own, "assume"); names.is_array()) {
        settings_.assumed.clear();
        for (const Json& name : names) {
            if (name.is_string()) {
                settings_.assumed.push_back(name.get<std::string>());
            }
        }
        workspace_.set_assumed(settings_.assumed);
    }
    const Json& machine = protocol::member(own, "machine");
    if (machine.is_string()) {
        machine_.set_name(machine.get<std::string>());
    }
}

}  // namespace hal::tools
