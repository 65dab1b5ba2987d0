// SPDX-License-Identifier: MIT
#include "run/replay_client.hpp"

#include <array>
#include <cerrno>
#include <sys/socket.h>
#include <unistd.h>

namespace hal::tools {

ReplayClient::~ReplayClient() { ::close(fd_); }

bool ReplayClient::read() {
    std::array<char, 65536> part{};
    const ssize_t bytes = ::recv(fd_, part.data(), part.size(), MSG_DONTWAIT);
    if (bytes < 0) return errno == EAGAIN || errno == EINTR;
    in_.append(part.data(), static_cast<std::size_t>(bytes));
    return bytes > 0 && (in_.size() <= max_line || in_.find('\n') <= max_line);
}

bool ReplayClient::next_line(std::string& line) {
    const std::size_t end = in_.find('\n');
    if (end == std::string::npos) return false;
    line.assign(in_, 0, end);
    in_.erase(0, end + 1);
    if (line.ends_with('\r')) {
        line.pop_back();
    }
    return true;
}

void ReplayClient::send(std::string_view bytes) {
    if (ended_) return;
    if (out_.size() - sent_ > max_waiting) {
        ended_ = true;
        return;
    }
    out_.append(bytes);
    write();
}

void ReplayClient::write() {
    while (has_output()) {
        const ssize_t bytes =
            ::send(fd_, out_.data() + sent_, out_.size() - sent_, MSG_DONTWAIT | MSG_NOSIGNAL);
        if (bytes < 0 && errno == EINTR) continue;
        if (bytes < 0) {
            ended_ = ended_ || errno != EAGAIN;
            break;
        }
        sent_ += static_cast<std::size_t>(bytes);
    }
    drop_sent();
}

/// A slow client may always have something left: what it has read must not pile up.
void ReplayClient::drop_sent() {
    constexpr std::size_t max_sent = std::size_t{1} << 20;
    if (has_output() && sent_ < max_sent) return;
    out_.erase(0, sent_);
    sent_ = 0;
}

}  // namespace hal::tools
