// SPDX-License-Identifier: MIT
// One client's side of the control protocol, without the socket: request lines in, reply lines out.
// docs/protocol.md. Internal to the server.
//
// Threads: handle() executes a request, in one thread at a time; which thread that is may change
// from request to request. All that only it uses is reached from nowhere else. What another thread
// may want meanwhile (the server's, while a worker is in handle()) is kept apart and synchronised
// by itself: the subscriptions have a mutex of their own, the counters and what idle() needs are
// atomic. Those members are marked [any]. The destructor and on_event() need that no other thread
// is in a member.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include <sys/types.h>

namespace hal {

class Shell;

class Connection {
public:
    /// `shell` is the program's own; the connection has a sibling of it. `peer` is the client's
    /// process.
    Connection(Shell& shell, pid_t peer);
    ~Connection();  ///< forgets an open `begin`; a component registered by the client is gone
    Connection(const Connection&) = delete;

    /// The line a client gets first.
    std::string hello() const;

    enum class Handled {
        done,  ///< the reply was appended
        wants_thread,  ///< it may wait: call again in a thread of its own with `may_wait`
        stop  ///< done, and the instance is to end
    };
    /// Executes one request line (without its end of line) and appends the reply. Whatever the line
    /// is, there is one.
    Handled handle(std::string_view line, std::string& replies, bool may_wait = false);
    /// True once a request was rejected because the machine ends: the client's further ones need
    /// not be read. False for a component, whose values are exchanged until the connection closes.
    /// Not while another thread is in handle().
    bool told_end() const;
    /// What execute_urgent() did with a line.
    enum class Urgent {
        no,  ///< nothing: handle() it
        done,  ///< the reply was appended
        stop,  ///< the same, and the instance is to end
        /// the functions of all threads have been requested to stop: ask halted() until it replies
        halting,
        lost  ///< a thread does not stop: handle() reports which
    };
    /// Executes a request that must not wait behind those of other clients: `stop` (the command and
    /// the verb) and `options`. Takes no lock. Not while another thread is in handle().
    Urgent execute_urgent(std::string_view line, std::string& reply);
    /// After execute_urgent() has returned `halting` for this line: `done` once the outputs of all
    /// threads have their safe values.
    Urgent halted(std::string_view line, std::string& reply);
    /// True for a request to cancel the command that is being executed; then it has been cancelled.
    /// To be asked about lines that come in while another thread is in handle(). [any]
    bool cancels(std::string_view line);
    void cancel(bool on = true);  ///< [any]

    /// Where lines go that a command which waits has for the client meanwhile; called in the thread
    /// that is in handle().
    void on_event(std::function<void(std::string line)> take);
    /// Keeps the connection for commands: it is beyond the `max_clients` that may have components.
    /// 0 makes it an ordinary one. [any]
    void reserve(std::size_t max_clients);
    /// True while nothing depends on this connection: no request being executed, no subscription,
    /// no component, no open `begin`. Never waits; may be false while the session's lock is held.
    /// [any]
    bool idle() const;

    /// When the next subscription is due, on the steady clock; INT64_MAX without a subscription.
    /// [any]
    std::int64_t next_due_ns() const;
    /// Appends the values of all subscriptions that are due. `congested`: counts them as skipped
    /// instead. Takes the session's lock. [any]
    void publish(std::int64_t now_ns, bool congested, std::string& events);

    std::uint64_t requests() const;  ///< [any]
    std::uint64_t invalid_requests() const;  ///< lines that were not valid requests [any]

    struct State;

private:
    std::unique_ptr<State> state_;
};

}  // namespace hal
