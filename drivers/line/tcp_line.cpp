// SPDX-License-Identifier: MIT
// A TCP connection as a line of bytes, from either side.
#include "tcp_line.hpp"

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
constexpr std::uint16_t default_port = 502;  // of Modbus TCP

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

struct SocketAddress {
    sockaddr_storage bytes{};
    socklen_t size = 0;
    const sockaddr* get() const { return reinterpret_cast<const sockaddr*>(&bytes); }
};

/// Resolves HOST, HOST:PORT or [HOST]:PORT. Returns the problem, or "".
std::string resolve(const std::string& target, const char* example, SocketAddress& address) {
    const auto colon = target.rfind(':');
    std::string host = target.substr(0, colon);
    std::uint16_t port = default_port;
    if (colon != target.npos &&
        (!parse_whole(std::string_view(target).substr(colon + 1), port) || port == 0)) {
        return "invalid port '" + target.substr(colon + 1) + "'; write " + example;
    }
    if (host.size() > 2 && host.front() == '[' && host.back() == ']') {
        host = host.substr(1, host.size() - 2);
    }
    addrinfo hints{};
    hints.ai_socktype = SOCK_STREAM;
    addrinfo* found = nullptr;
    const int error = getaddrinfo(host.c_str(), std::to_string(port).c_str(), &hints, &found);
    if (error != 0) return "unknown host '" + host + "': " + gai_strerror(error);
    std::memcpy(&address.bytes, found->ai_addr, found->ai_addrlen);
    address.size = found->ai_addrlen;
    freeaddrinfo(found);
    return {};
}

}  // namespace

std::string with_port(const std::string& target) {
    const bool has_port = target.rfind(':') != target.npos && !target.ends_with(']');
    return has_port ? target : target + ":" + std::to_string(default_port);
}

Opened open(const std::string& target, const Options&) {
    SocketAddress peer;
    std::string problem = resolve(target, "tcp:HOST:502", peer);
    if (!problem.empty()) return {nullptr, std::move(problem)};
    return {std::make_unique<ClientLine>(describe(target), peer.bytes, peer.size), {}};
}
Description describe(const std::string& target) {
    return {.address = "tcp:" + target, .transport = "TCP connection", .is_stream = true};
}

Opened open_listener(const std::string& target, const Options&) {
    const bool is_port = target.find(':') == target.npos;
    SocketAddress own;
    std::string problem = resolve(is_port ? "127.0.0.1:" + target : target, "listen:5020", own);
    if (!problem.empty()) return {nullptr, std::move(problem)};
    link::Descriptor fd(
        ::socket(own.bytes.ss_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
    const int on = 1;
    setsockopt(fd.get(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
    if (::bind(fd.get(), own.get(), own.size) != 0 || ::listen(fd.get(), 4) != 0) {
        return {nullptr, "cannot listen: " + link::reason()};
    }
    return {std::make_unique<ServerLine>(describe_listener(target), std::move(fd)), {}};
}
Description describe_listener(const std::string& target) {
    return {.address = "listen:" + target, .transport = "TCP port", .is_stream = true};
}

}  // namespace hal::line::tcp
