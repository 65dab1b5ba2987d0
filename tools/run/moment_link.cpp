// SPDX-License-Identifier: MIT
#include "run/moment_link.hpp"

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <fmt/core.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include "cli/output.hpp"
#include "run/replayed_moment.hpp"

namespace hal::tools {

MomentLink::~MomentLink() {
    if (socket_ >= 0) {
        ::close(socket_);
    }
}

bool MomentLink::start(const ReplayOptions& options, JournalFile& file, const WhatIf& change) {
    int ends[2];
    if (::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends) != 0) {
        fail(options, fmt::format("cannot create a socket: {}", std::strerror(errno)));
        return false;
    }
    const pid_t moment = frames_.start();
    if (moment < 0) {
        fail(options, fmt::format("cannot create a process: {}", std::strerror(errno)));
        ::close(ends[0]);
        ::close(ends[1]);
        return false;
    }
    if (moment == 0) {
        ::close(ends[0]);
        std::signal(SIGTTOU, SIG_IGN);  // it prints while the front has the terminal
        ReplayedMoment(options, file, frames_, change, ends[1]).serve();
    }
    ::close(ends[1]);
    socket_ = ends[0];
    return true;
}

bool MomentLink::send(const Errand& errand, std::string_view request) {
    send_packet(&errand, sizeof errand);
    while (!ended_ && !request.empty()) {
        const std::string_view part = request.substr(0, max_packet);
        send_packet(part.data(), part.size());
        request.remove_prefix(part.size());
    }
    return !ended_;
}

void MomentLink::send_packet(const void* bytes, std::size_t size) {
    while (::send(socket_, bytes, size, MSG_NOSIGNAL) < 0) {
        if (errno == EINTR) continue;
        ended_ = true;
        return;
    }
}

std::optional<MomentLink::Received> MomentLink::receive(int timeout_ms) {
    constexpr int check_every_ms = 100;
    buffer_.resize(max_packet + 1);
    while (!ended_) {
        const int wait_ms = timeout_ms < 0 ? check_every_ms : std::min(timeout_ms, check_every_ms);
        pollfd event{socket_, POLLIN, 0};
        const int ready = ::poll(&event, 1, wait_ms);
        if (ready < 0) continue;
        if (ready == 0) {
            ended_ = !frames_.alive();
            if (timeout_ms >= 0) return std::nullopt;
            continue;
        }
        const ssize_t bytes = ::recv(socket_, buffer_.data(), buffer_.size(), 0);
        if (bytes < 0 && errno == EINTR) continue;
        if (bytes <= 0) {
            ended_ = true;
            break;
        }
        return Received{static_cast<Packet>(buffer_[0]),
                        buffer_.substr(1, static_cast<std::size_t>(bytes) - 1)};
    }
    return std::nullopt;
}

}  // namespace hal::tools
