// SPDX-License-Identifier: MIT
#include "panel/web_client.hpp"

#include <algorithm>
#include <libwebsockets.h>

namespace hal::tools {

bool WebClient::send(std::string_view text, bool binary, bool live) {
    if (close_code_ != 0 || (live && waiting_ > max_live)) return false;
    if (waiting_ > max_waiting) {
        queue_.clear();
        waiting_ = 0;
        close(1013, "the client reads too slowly");
        return false;
    }
    Message message{std::string(LWS_PRE, '\0'), binary};
    message.bytes.append(text);
    waiting_ += text.size();
    queue_.push_back(std::move(message));
    lws_callback_on_writable(wsi_);
    return true;
}

void WebClient::close(int code, std::string_view reason) {
    if (close_code_ != 0) return;
    close_code_ = code;
    close_reason_ = reason.substr(0, 120);
    lws_callback_on_writable(wsi_);
}

void WebClient::drop() {
    lws_set_timeout(wsi_, PENDING_TIMEOUT_KILLED_BY_PARENT, LWS_TO_KILL_ASYNC);
}

bool WebClient::closing() {
    lws_close_reason(wsi_, static_cast<lws_close_status>(close_code_),
                     reinterpret_cast<unsigned char*>(close_reason_.data()), close_reason_.size());
    return false;
}

bool WebClient::received(std::string_view part, bool last, bool binary, std::int64_t now_ms) {
    if (close_code_ != 0) {
        return true;  // on its way out
    }
    if (part_.size() + part.size() > max_message_size) {
        close_code_ = 1009;
        close_reason_ = "a message has at most 65536 bytes";
        return closing();
    }
    part_.append(part);
    if (!last) return true;
    if (counted_ms_ != 0) {
        allowance_ = std::min(
            burst, allowance_ + static_cast<double>(now_ms - counted_ms_) * messages_per_s / 1000);
    }
    counted_ms_ = now_ms;
    if (--allowance_ < 0) {
        close_code_ = 1008;
        close_reason_ = "more than 200 messages per second";
        return closing();
    }
    const std::string whole = std::move(part_);
    part_.clear();
    message(whole, binary);
    return true;
}

bool WebClient::writeable() {
    if (queue_.empty()) return close_code_ == 0 || closing();
    Message message = std::move(queue_.front());
    queue_.pop_front();
    const std::size_t size = message.bytes.size() - LWS_PRE;
    waiting_ -= size;
    auto* const bytes = reinterpret_cast<unsigned char*>(message.bytes.data()) + LWS_PRE;
    if (lws_write(wsi_, bytes, size, message.binary ? LWS_WRITE_BINARY : LWS_WRITE_TEXT) <
        static_cast<int>(size)) {
        return false;
    }
    if (!queue_.empty() || close_code_ != 0) {
        lws_callback_on_writable(wsi_);
    }
    if (waiting_ < max_live / 4) {
        drained();
    }
    return true;
}

}  // namespace hal::tools
