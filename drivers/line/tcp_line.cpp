// SPDX-License-Identifier: MIT
// A TCP connection as a line of bytes, from either side.
#include "tcp_line.hpp"

#include <arpa/inet.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

#include <cstring>

#include "link/system.hpp"
#include "text/numbers.hpp"

namespace hal::line::tcp {

namespace {

constexpr std::int64_t retry_ns = 500'000'000;
constexpr std::int64_t connect_ns = 1'000'000'000;

void prepare(int fd) noexcept {
    const int on = 1;
    setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    setsockopt(fd, SOL_SOCKET, SO_KEEPALIVE, &on, sizeof on);
}

/// Bytes over a connected socket.
class StreamLine : public Line {
public:
    explicit StreamLine(Description description) : description_(std::move(description)) {}
    const Description& description() const noexcept override { return description_; }
    bool send(std::span<const std::uint8_t> bytes, std::int64_t now_ns) noexcept override {
        if (!connected_) return false;
        const ssize_t sent = ::send(fd_.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL);
        if (sent == static_cast<ssize_t>(bytes.size())) {
            sent_until_ = now_ns;
            return true;
        }
        close(now_ns);  // a part of a telegram on a stream cannot be taken back
        return false;
    }
    std::size_t receive(std::span<std::uint8_t> bytes, std::int64_t now_ns) noexcept override {
        if (!connected_) return 0;
        const ssize_t count = ::recv(fd_.get(), bytes.data(), bytes.size(), 0);
        if (count > 0) return static_cast<std::size_t>(count);
        if (count == 0 || (errno != EAGAIN && errno != EINTR)) {
            close(now_ns);
        }
        return 0;
    }
    std::int64_t sent_until_ns() const noexcept override { return sent_until_; }

protected:
    void close(std::int64_t now_ns) noexcept {
        fd_ = link::Descriptor();
        connected_ = false;
        retry_at_ = now_ns + retry_ns;
    }

    Description description_;
    link::Descriptor fd_;
    bool connected_ = false;
    std::int64_t retry_at_ = 0;
    std::int64_t sent_until_ = INT64_MIN / 2;
};

class ClientLine final : public StreamLine {
public:
    ClientLine(Description description, const sockaddr_storage& peer, socklen_t size)
        : StreamLine(std::move(description)), peer_(peer), size_(size) {}

    bool is_open(std::int64_t now_ns) noexcept override {
        if (connected_) return true;
        if (!fd_) {
            if (now_ns < retry_at_) return false;
            begin(now_ns);
        }
        if (fd_) {
            finish(now_ns);
        }
        return connected_;
    }
    int descriptor() const noexcept override { return fd_.get(); }

private:
    void begin(std::int64_t now_ns) noexcept {
        retry_at_ = now_ns + retry_ns;
        give_up_at_ = now_ns + connect_ns;
        fd_ = link::Descriptor(
            ::socket(peer_.ss_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
        if (!fd_) return;
        prepare(fd_.get());
        if (::connect(fd_.get(), reinterpret_cast<const sockaddr*>(&peer_), size_) != 0 &&
            errno != EINPROGRESS) {
            fd_ = link::Descriptor();
        }
    }
    void finish(std::int64_t now_ns) noexcept {
        pollfd p{fd_.get(), POLLOUT, 0};
        if (::poll(&p, 1, 0) <= 0) {
            if (now_ns >= give_up_at_) {
                fd_ = link::Descriptor();
            }
            return;
        }
        int error = 0;
        socklen_t size = sizeof error;
        getsockopt(fd_.get(), SOL_SOCKET, SO_ERROR, &error, &size);
        if (error != 0) {
            fd_ = link::Descriptor();
            return;
        }
        connected_ = true;
    }

    sockaddr_storage peer_;
    socklen_t size_;
    std::int64_t give_up_at_ = 0;
};

class ServerLine final : public StreamLine {
public:
    ServerLine(Description description, link::Descriptor listener)
        : StreamLine(std::move(description)), listener_(std::move(listener)) {}

    bool is_open(std::int64_t) noexcept override {
        if (connected_) return true;
        fd_ = link::Descriptor(
            ::accept4(listener_.get(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC));
        connected_ = static_cast<bool>(fd_);
        if (connected_) {
            prepare(fd_.get());
        }
        return connected_;
    }
    int descriptor() const noexcept override { return connected_ ? fd_.get() : listener_.get(); }

private:
    link::Descriptor listener_;
};

}  // namespace

Opened open(const std::string& target, const Options&) {
    const auto colon = target.rfind(':');
    std::string host = target.substr(0, colon);
    std::uint16_t port = 502;
    if (colon != target.npos &&
        (!parse_whole(std::string_view(target).substr(colon + 1), port) || port == 0)) {
        return {nullptr, "invalid port '" + target.substr(colon + 1) + "'; write tcp:HOST:502"};
    }
    if (host.size() > 2 && host.front() == '[' && host.back() == ']') {
        host = host.substr(1, host.size() - 2);
    }
    addrinfo hints{};
    hints.ai_socktype = SOCK_STREAM;
    addrinfo* found = nullptr;
    const int error = getaddrinfo(host.c_str(), std::to_string(port).c_str(), &hints, &found);
    if (error != 0) return {nullptr, "unknown host '" + host + "': " + gai_strerror(error)};
    sockaddr_storage peer{};
    std::memcpy(&peer, found->ai_addr, found->ai_addrlen);
    const socklen_t size = found->ai_addrlen;
    freeaddrinfo(found);
    return {std::make_unique<ClientLine>(describe(target), peer, size), {}};
}
Description describe(const std::string& target) {
    return {.address = "tcp:" + target, .transport = "TCP connection", .is_stream = true};
}

Opened open_listener(const std::string& target, const Options&) {
    std::uint16_t port = 0;
    if (!parse_whole(target, port)) {
        return {nullptr, "invalid port '" + target + "'; write listen:5020"};
    }
    link::Descriptor fd(::socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
    const int on = 1;
    setsockopt(fd.get(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
    sockaddr_in own{};
    own.sin_family = AF_INET;
    own.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    own.sin_port = htons(port);
    if (::bind(fd.get(), reinterpret_cast<const sockaddr*>(&own), sizeof own) != 0 ||
        ::listen(fd.get(), 4) != 0) {
        return {nullptr, "cannot listen on port " + target + ": " + link::reason()};
    }
    return {std::make_unique<ServerLine>(describe_listener(target), std::move(fd)), {}};
}
Description describe_listener(const std::string& target) {
    return {.address = "listen:" + target, .transport = "TCP port", .is_stream = true};
}

}  // namespace hal::line::tcp
