// SPDX-License-Identifier: MIT
// The other end of the control socket, for tools: docs/protocol.md. Knows the base and JSON, not
// the session.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "commands/completion.hpp"
#include "machine/processes/address.hpp"

namespace hal {

class Client {
public:
    /// Connects to a running instance by its name. Returns nullptr and sets `problem` to the reason
    /// and what to type.
    static std::unique_ptr<Client> connect(std::string_view instance, std::string& problem);
    ~Client();
    Client(const Client&) = delete;

    const std::string& instance() const;
    const std::string& version() const;  ///< of the runtime on the other side
    std::int64_t pid() const;
    /// False once the connection is lost; then every answer has status 1 and reports it.
    bool connected() const;
    /// Looks whether the other side is still there, without waiting; events that have come are
    /// kept.
    bool look();
    /// How the instance ended, once the connection is lost. Waits up to 1 s for a process that is
    /// just ending.
    InstanceEnd instance_end() const;
    /// The reason the server gave for closing the connection; "" when it gave none.
    const std::string& closed_because() const;
    /// Receives what a waiting command reports meanwhile; without it these reports are dropped.
    void on_notice(std::function<void(std::string_view)> take);
    /// After fork(), in the child: closes its copy of the socket, so that the end of the parent
    /// ends the connection. No lock is taken.
    void close_in_child();
    int fd() const;  ///< for poll(); readable when next_event() may have something
    /// A non-blocking descriptor (for example a signalfd) that becomes readable when the user wants
    /// no more of the command that runs: then it is emptied and the command cancelled; a second
    /// time, the connection is given up.
    void cancel_on(int descriptor);

    struct Options {
        bool keep_going = false;
        bool echo = false;
        bool script = false;
        bool json = false;
        bool color = false;

        bool notes = false;
        std::string level = "errors";  ///< nothing, errors, results, debug
        /// for relative paths in commands; the tool's working directory
        std::string directory;
        /// section, key, value, "FILE:LINE" of what [SECTION]KEY means; empty: the instance's INI
        /// file
        std::vector<std::array<std::string, 4>> ini = {};
    };
    /// Holds for all commands of this connection from now on.
    bool set_options(const Options& options);

    struct Answer {
        int status = 1;
        /// False: the instance did not execute it, or the connection was lost; `err` has the
        /// reason.
        bool executed = false;
        std::string out, err;
        bool quit = false;  ///< the command was quit or exit
        bool collecting = false;  ///< between begin and commit
    };
    /// Runs one line; waits for its end. `number` is the line's in what messages call `name`.
    Answer run(std::string_view line, std::string_view name = "<shell>", std::uint32_t number = 1);
    /// Runs one command of words that are passed as they are.
    Answer run(const std::vector<std::string>& words, std::string_view name = "<commandline>");
    /// Runs a text as a file; $NAME in it is looked up in this process's environment.
    Answer run_text(std::string_view name, std::string_view text);
    Completion complete(std::string_view line, std::size_t cursor);
    /// Ends the instance.
    Answer stop();

    /// Any request: `body` without an id. Waits for its reply, a JSON object (docs/protocol.md);
    /// when the connection is lost: {"ok":false,"error":"…"}. Events that come meanwhile are kept
    /// for next_event().
    nlohmann::json request(nlohmann::json body);
    /// Sends without waiting; replies come in the order of the requests through wait().
    std::uint64_t send(nlohmann::json body);
    nlohmann::json wait(std::uint64_t id);
    /// The next event (values of a subscription …): true and `event`, or false after `timeout_ms`
    /// (-1: waits for ever).
    bool next_event(nlohmann::json& event, int timeout_ms);
    /// The same; `payload` is the raw bytes that follow an event with the member "bytes".
    bool next_event(nlohmann::json& event, std::string& payload, int timeout_ms);

private:
    Client();
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace hal
