// SPDX-License-Identifier: MIT
// One WebSocket connection: messages in one piece, a bounded queue of messages to send.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <string>
#include <string_view>

struct lws;

namespace hal::tools {

class WebClient {
public:
    explicit WebClient(lws* wsi) : wsi_(wsi) {}
    virtual ~WebClient() = default;
    WebClient(const WebClient&) = delete;

    /// Queues a message. A live message is dropped when the client reads too slowly; others close
    /// the connection then. Returns false for a dropped one.
    bool send(std::string_view text, bool binary = false, bool live = false);
    std::size_t waiting() const { return waiting_; }
    /// Closes the connection after what is queued, with a code of RFC 6455 section 7.4 and a
    /// reason.
    void close(int code, std::string_view reason);
    /// Ends the connection without waiting for the client.
    void drop();

    /// Called every 50 ms.
    virtual void tick(std::int64_t) {}
    virtual bool by_token() const { return false; }
    /// The client may read: it has greeted, with the token where that is needed.
    virtual bool admitted() const { return false; }

    // Called by the event loop. False: the connection is closed.
    bool received(std::string_view part, bool last, bool binary, std::int64_t now_ms);
    bool writeable();

protected:
    /// Handles a whole message.
    virtual void message(std::string_view text, bool binary) = 0;
    /// The queue is short again.
    virtual void drained() {}

private:
    struct Message {
        std::string bytes;  ///< behind LWS_PRE bytes for the library
        bool binary;
    };
    static constexpr std::size_t max_message_size = 64 << 10;
    static constexpr std::size_t max_live = 1 << 20;

    static constexpr std::size_t max_waiting = 96 << 20;
    static constexpr double messages_per_s = 200;
    static constexpr double burst = 400;
    bool closing();

    lws* wsi_;
    std::deque<Message> queue_;
    std::size_t waiting_ = 0;
    std::string part_;
    double allowance_ = burst;
    std::int64_t counted_ms_ = 0;
    int close_code_ = 0;
    std::string close_reason_;
};

}  // namespace hal::tools
