// SPDX-License-Identifier: MIT
// The server: takes messages, answers requests, publishes diagnostics.
#pragma once

#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "lsp/language_features.hpp"
#include "lsp/protocol.hpp"
#include "lsp/workspace.hpp"

namespace hal::tools {

/// One client. [setup]
class LanguageServer {
public:
    struct Settings {
        std::string ini;      ///< for netlists that no INI file names; empty: none
        std::vector<std::string> assumed;  ///< components of the target machine only
        std::string machine;  ///< the instance of live values; empty: the default
    };
    /// Receives the body of each message to the client.
    using Send = std::function<void(const std::string& body)>;

    LanguageServer(Settings settings, Send send);

    /// Takes the body of a message, whatever it contains.
    void handle(std::string_view body);
    /// Loads one netlist that has changed and publishes its diagnostics, or frees what was replaced.
    void work();
    /// How long to wait for messages before work() has something to do; -1: for ever.
    int idle_ms() const;
    /// After the notification `exit`.
    bool ended() const { return state_ == State::ended; }
    /// After the request `shutdown`.
    bool was_shut_down() const { return shut_down_; }

private:
    using Json = protocol::Json;
    enum class State { created, initialized, ended };
    struct Request {
        const char* method;
        Json (LanguageServer::*answer)(const Json& params);
    };
    struct Feature {
        const char* method;
        Json (LanguageFeatures::*answer)(const Json& params);
    };
    struct Notification {
        const char* method;
        void (LanguageServer::*handle)(const Json& params);
    };
    static const Request requests[];
    static const Feature features[];
    static const Notification notifications[];

    void handle_message(const Json& message);
    void answer(const Json& id, const std::string& method, const Json& params);
    Json result_of(const std::string& method, const Json& params);
    void send(const Json& message);
    void send_error(const Json& id, protocol::ErrorCode code, const std::string& text);
    void notify(const char* method, Json params);
    void publish();
    void refresh_hints();

    Json initialize(const Json& params);
    Json shutdown(const Json& params);
    Json execute_command(const Json& params);
    void ignore(const Json& params);
    void end(const Json& params);
    void opened(const Json& params);
    void changed(const Json& params);
    void saved(const Json& params);
    void closed(const Json& params);
    void configured(const Json& params);

    Settings settings_;
    Send send_;
    State state_ = State::created;
    bool shut_down_ = false;
    bool unpublished_ = false;  // a document has changed since publish()
    Workspace workspace_;
    LiveMachine machine_;
    LanguageFeatures features_{workspace_, machine_};
    bool can_refresh_hints_ = false;
    std::int64_t refreshes_ = 0;  // requests of this server
    std::map<std::string, std::string> published_;  // by URI: the last message
};

}  // namespace hal::tools
