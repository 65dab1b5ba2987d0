// SPDX-License-Identifier: MIT
// One client of the control socket of a replayed machine: lines in, lines out, subscriptions.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace hal::tools {

/// [setup]
class ReplayClient {
public:
    struct Subscription {
        std::vector<std::string> names;
        bool changes_only = false;
        std::string last;  ///< the values that were sent, as JSON
    };

    /// Takes over the descriptor of a connection, which does not block.
    ReplayClient(int fd, std::uint64_t number) : fd_(fd), number_(number) {}
    ~ReplayClient();
    ReplayClient(const ReplayClient&) = delete;

    int fd() const { return fd_; }
    std::uint64_t number() const { return number_; }
    /// Reads what has arrived. Returns false when the connection has ended, or a line is too long.
    bool read();
    /// Returns true and the next complete line, without its end.
    bool next_line(std::string& line);
    /// Queues bytes. They are dropped, and ended() becomes true, when the client does not read.
    void send(std::string_view bytes);
    /// Writes what is queued, as far as possible.
    void write();
    bool has_output() const { return sent_ < out_.size(); }
    bool ended() const { return ended_; }
    void end() { ended_ = true; }

    bool json = false;  ///< `show` answers in JSON
    bool follows = false;  ///< gets events of the moment
    std::map<std::uint64_t, Subscription> subscriptions;
    std::uint64_t numbers = 0;  ///< of subscriptions and rows, so far

private:
    void drop_sent();

    static constexpr std::size_t max_line = std::size_t{1} << 20;
    static constexpr std::size_t max_waiting = std::size_t{64} << 20;

    const int fd_;
    const std::uint64_t number_;
    std::string in_;
    std::string out_;
    std::size_t sent_ = 0;
    bool ended_ = false;
};

}  // namespace hal::tools
