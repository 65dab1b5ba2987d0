// SPDX-License-Identifier: MIT
// A connection to the control socket of an instance within the event loop: lines in, lines out,
// reconnecting. docs/protocol.md.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

struct lws;
struct lws_vhost;

namespace hal::tools {

class ControlLink {
public:
    class User {
    public:
        virtual ~User() = default;
        /// The instance has answered; `hello` is its first line.
        virtual void machine_up(std::string_view hello) = 0;
        virtual void machine_down() = 0;
        /// A reply or an event, and the bytes that follow an event with a payload.
        virtual void machine_line(std::string_view line, std::string_view payload) = 0;
    };

    ControlLink(lws_vhost* host, std::string instance, User& user)
        : host_(host), instance_(std::move(instance)), user_(user) {}
    ~ControlLink();
    ControlLink(const ControlLink&) = delete;

    /// Chooses the instance; before the first retry().
    void choose(std::string instance) { instance_ = std::move(instance); }
    const std::string& instance() const { return instance_; }

    /// Tries to connect when the link is down. Call it every half second. Returns false when no
    /// instance answers.
    bool retry();
    bool up() const { return greeted_; }
    /// Queues a line, without its end. Returns false when the link is down or too much is waiting.
    bool send(std::string_view line);
    /// While paused nothing is read: the instance then skips values of subscriptions.
    void pause(bool on);

    // Called by the event loop.
    bool received(std::string_view bytes);
    bool writeable();
    void closed();

private:
    static constexpr std::size_t max_waiting = 1 << 20;

private:
    static constexpr std::size_t max_line_length = 64 << 20;
    bool receive_lines();

    lws_vhost* host_;
    std::string instance_;
    User& user_;
    lws* wsi_ = nullptr;
    bool greeted_ = false;
    bool paused_ = false;
    std::string in_, out_;
    std::size_t searched_ = 0;
};

}  // namespace hal::tools
