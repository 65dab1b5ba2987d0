// SPDX-License-Identifier: MIT
// One client's side of the control protocol, without the socket: request lines in, reply lines out. docs/protocol.md.
// Internal to the shell. One thread at a time, but for cancel().
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include <sys/types.h>

namespace hal {

class Shell;

class Connection {
public:
    /// `shell` is the program's own; the connection has a sibling of it. `peer` is the client's process.
    Connection(Shell& shell, pid_t peer);
    ~Connection();  ///< forgets an open `begin`; a component registered by the client is gone
    Connection(const Connection&) = delete;

    /// The line a client gets first.
    std::string hello() const;

    enum class Handled {
        done,          ///< the reply was appended
        wants_thread,  ///< it may wait: call again in a thread of its own with `may_wait`
        stop           ///< done, and the instance is to end
    };
    /// Executes one request line (without its end of line) and appends the reply. Whatever the line is, there is one.
    Handled handle(std::string_view line, std::string& replies, bool may_wait = false);
    /// True for a request to cancel the command that is being executed; then it has been cancelled. To be asked about
    /// lines that come in while another thread is in handle(). [any]
    bool cancels(std::string_view line);
    void cancel(bool on = true);  ///< [any]

    /// When the next subscription is due, on the steady clock; INT64_MAX when there is none.
    std::int64_t next_due_ns() const;
    /// Appends the values of all subscriptions that are due. `congested`: counts them as skipped instead.
    void publish(std::int64_t now_ns, bool congested, std::string& events);

    std::uint64_t requests() const;
    std::uint64_t rubbish() const;  ///< lines that were no requests

    struct State;

private:
    std::unique_ptr<State> state_;
};

}  // namespace hal
