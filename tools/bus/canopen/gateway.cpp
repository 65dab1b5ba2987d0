// SPDX-License-Identifier: MIT
// `hal can gateway`: the gateway of CiA 309-3 behind a local socket; programs write lines and read
// answers.
#include "bus/canopen/gateway.hpp"

#include <arpa/inet.h>
#include <cstdlib>
#include <fcntl.h>
#include <fmt/core.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "bus/can/bus.hpp"
#include "canopen/master/gateway/gateway.hpp"
#include "canopen/protocol/lss.hpp"
#include "cli/output.hpp"
#include "text/numbers.hpp"

namespace hal::tools {

namespace {

using canopen::gateway::Gateway;

/// A socket file that is removed with its owner.
struct Listener {
    int fd = -1;
    std::string file, shown;
    ~Listener() {
        if (fd >= 0) {
            ::close(fd);
        }
        if (!file.empty()) {
            ::unlink(file.c_str());
        }
    }
};

std::string default_socket() {
    const char* folder = std::getenv("XDG_RUNTIME_DIR");
    return std::string(folder && *folder ? folder : "/tmp") + "/halcyon-canopen-gateway";
}

bool listen_locally(const GatewayOptions& options, Listener& out) {
    const std::string path = options.socket.empty() ? default_socket() : options.socket;
    sockaddr_un at{};
    at.sun_family = AF_UNIX;
    if (path.size() >= sizeof at.sun_path) {
        fail(options, fmt::format("the path '{}' is too long for a socket; at most {} bytes", path,
                                  sizeof at.sun_path - 1));

        return false;
    }
    std::memcpy(at.sun_path, path.c_str(), path.size() + 1);
    out.fd = ::socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    const int probe = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    const bool taken = ::connect(probe, reinterpret_cast<const sockaddr*>(&at), sizeof at) == 0;
    ::close(probe);
    if (taken) {
        fail(options,
             fmt::format("another gateway listens on '{}'; choose another socket: --socket PATH",
                         path));

        return false;
    }
    struct stat about{};
    if (::lstat(path.c_str(), &about) == 0) {
        if (!S_ISSOCK(about.st_mode)) {
            fail(options,
                 fmt::format("'{}' exists and is not a socket; choose another: --socket PATH",
                             path));

            return false;
        }
        ::unlink(path.c_str());  // left by a killed gateway
    }
    const mode_t before = ::umask(0177);  // for its owner only
    const bool bound = ::bind(out.fd, reinterpret_cast<const sockaddr*>(&at), sizeof at) == 0;
    const int why = errno;
    ::umask(before);
    if (!bound || ::listen(out.fd, 16) != 0) {
        fail(options,
             fmt::format("cannot listen on '{}': {}", path, std::strerror(bound ? errno : why)));

        return false;
    }
    out.file = out.shown = path;
    return true;
}

bool listen_on_port(const GatewayOptions& options, Listener& out) {
    const std::string& text = options.listen;
    const auto colon = text.rfind(':');
    std::uint16_t port = 0;
    sockaddr_in at{};
    at.sin_family = AF_INET;
    const bool good = colon != text.npos && parse_whole(text.substr(colon + 1), port) &&
                      ::inet_pton(AF_INET, text.substr(0, colon).c_str(), &at.sin_addr) == 1;
    if (!good) {
        fail(options, fmt::format("invalid --listen '{}'; write 127.0.0.1:6000", text));

        return false;
    }
    if ((ntohl(at.sin_addr.s_addr) >> 24) != 127) {
        fail(options, fmt::format("--listen '{}' would let other machines command this bus; "
                                  "listen on 127.0.0.1 and forward the port: ssh -L",
                                  text));

        return false;
    }
    at.sin_port = htons(port);
    out.fd = ::socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    const int yes = 1;
    ::setsockopt(out.fd, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
    if (::bind(out.fd, reinterpret_cast<const sockaddr*>(&at), sizeof at) != 0 ||
        ::listen(out.fd, 16) != 0) {
        fail(options, fmt::format("cannot listen on {}: {}", text, std::strerror(errno)));

        return false;
    }
    socklen_t size = sizeof at;
    ::getsockname(out.fd, reinterpret_cast<sockaddr*>(&at),
                  &size);  // port 0: a free port was chosen
    out.shown = text.substr(0, colon) + ":" + std::to_string(ntohs(at.sin_port));
    return true;
}

struct Connection {
    int fd, client;
    /// it sends no more commands, but may still read responses
    bool input_ended = false;
};

/// Returns true when the other side has closed both directions.
bool is_closed(int fd) {
    pollfd state{fd, 0, 0};
    return ::poll(&state, 1, 0) > 0 && (state.revents & (POLLHUP | POLLERR)) != 0;
}

class Server {
public:
    Server(const GatewayOptions& options, std::vector<std::unique_ptr<can::Link>>& links,
           StopRequest& stop, canopen::gateway::Identity identity)
        : options_(options),
          links_(links),
          stop_(stop),
          gateway_(static_cast<unsigned>(links.size()), std::move(identity)) {
        gateway_.initialise = [this](unsigned net, std::uint32_t index) {
            const std::uint32_t rate = links_[net - 1]->description().bit_rate;
            return index == 9 || rate == 0 || rate == can::unlimited ||
                   rate == canopen::lss_bit_rate(index);
        };
        gateway_.keep = [this](const std::string& commands) { return keep(commands); };
    }
    int run(const Listener& listener) {
        std::string settings, problem;
        if (!options_.state.empty() && ::access(options_.state.c_str(), F_OK) == 0) {
            if (!read_file(options_.state, settings)) {
                return fail(options_,
                            fmt::format("cannot read '{}': {}", options_.state, settings));
            }
            gateway_.configure(settings, monotonic_ns());
        }
        while (!stop_.requested()) {
            wait(listener);
            carry();
            serve(listener);
            gateway_.poll(monotonic_ns());
            carry();
            std::erase_if(connections_, [this](const Connection& c) {
                return !flush(c) || (c.input_ended && gateway_.is_served(c.client) && end(c));
            });
        }
        return 0;
    }

private:
    bool keep(const std::string& commands) {
        if (options_.state.empty()) return false;
        if (commands.empty()) return ::unlink(options_.state.c_str()) == 0 || errno == ENOENT;
        return write_file(options_.state, commands).empty();
    }
    void wait(const Listener& listener) {
        std::vector<pollfd> all{{stop_.fd(), POLLIN, 0}, {listener.fd, POLLIN, 0}};
        bool polled = true;
        for (const auto& link : links_) {
            polled = polled && link->descriptor() >= 0;
            all.push_back({link->descriptor(), POLLIN, 0});
        }
        for (const Connection& c : connections_) {
            const int reads = c.input_ended ? 0 : POLLIN;
            const int writes = gateway_.output(c.client).empty() ? 0 : POLLOUT;
            all.push_back({c.fd, static_cast<short>(reads | writes), 0});
        }
        ::poll(all.data(), all.size(), gateway_.idle() && polled ? 20 : 1);
    }
    /// Exchanges frames between the nets and their buses.
    void carry() {
        for (unsigned net = 1; net <= links_.size(); ++net) {
            can::Link& link = *links_[net - 1];
            canopen::FrameQueue& out = gateway_.out(net);
            for (std::size_t count; (count = link.receive(buffer_, can::unclocked)) > 0;) {
                for (std::size_t n = 0; n < count; ++n) {
                    if (!buffer_[n].own) {
                        gateway_.handle(net, buffer_[n], monotonic_ns());
                    }
                }
            }
            for (const can::Frame* f; (f = out.front()) != nullptr &&
                                      link.send(*f, can::unclocked) == can::Sent::queued;) {
                out.drop();
            }
            link.flush(can::unclocked);
        }
    }
    void serve(const Listener& listener) {
        if (const int fd = ::accept4(listener.fd, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
            fd >= 0) {
            const int yes = 1;
            ::setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);
            connections_.push_back({fd, gateway_.connect()});
        }
        for (auto c = connections_.begin(); c != connections_.end();) {
            if (receive(*c)) {
                ++c;
            } else {
                end(*c);
                c = connections_.erase(c);
            }
        }
    }
    /// Returns false when the client has disconnected.
    bool receive(Connection& c) {
        if (c.input_ended) return !is_closed(c.fd);
        char bytes[65536];
        const ssize_t got = ::recv(c.fd, bytes, sizeof bytes, 0);
        if (got < 0) return errno == EAGAIN || errno == EINTR;
        c.input_ended = got == 0;
        if (got > 0) {
            gateway_.receive(c.client, {bytes, static_cast<std::size_t>(got)}, monotonic_ns());
        }
        return true;
    }
    bool end(const Connection& c) {
        gateway_.disconnect(c.client);
        return ::close(c.fd), true;
    }
    /// Returns false when the client has disconnected, or does not read.
    bool flush(const Connection& c) {
        std::string& text = gateway_.output(c.client);
        while (!text.empty()) {
            const ssize_t sent = ::send(c.fd, text.data(), text.size(), MSG_NOSIGNAL);
            if (sent < 0 && errno == EINTR) continue;
            if (sent < 0 && errno != EAGAIN) {
                end(c);
                return false;
            }
            if (sent < 0) break;
            text.erase(0, static_cast<std::size_t>(sent));
        }
        return text.size() <= Gateway::max_output || (end(c), false);
    }

    const GatewayOptions& options_;
    std::vector<std::unique_ptr<can::Link>>& links_;
    StopRequest& stop_;
    Gateway gateway_;
    std::vector<Connection> connections_;
    std::vector<can::Frame> buffer_ = std::vector<can::Frame>(256);
};

/// --identity, --vendor-name, --product-name, --order-code. False after an error message.
bool read_identity(const GatewayOptions& options, canopen::gateway::Identity& out) {
    std::uint32_t* const numbers[] = {&out.vendor, &out.product, &out.revision, &out.serial};
    std::size_t count = 0;
    for (const char* at = options.identity.c_str(); *at != '\0';) {
        char* end = nullptr;
        errno = 0;
        const unsigned long long number = std::strtoull(at, &end, 0);
        if (end == at || *at == '-' || errno != 0 || number > 0xffffffffU ||
            (*end != ',' && *end != '\0') || count == std::size(numbers)) {
            fail(options,
                 fmt::format("invalid --identity '{}'; write VENDOR,PRODUCT,REVISION,SERIAL, "
                             "such as 0x1234,7,0x00010002,42",
                             options.identity));

            return false;
        }
        *numbers[count++] = static_cast<std::uint32_t>(number);
        at = *end == ',' ? end + 1 : end;
    }
    struct Name {
        const char* option;
        const std::string& given;
        std::string& to;
    };
    for (const Name& name : {Name{"--vendor-name", options.vendor_name, out.vendor_name},
                             Name{"--product-name", options.product_name, out.product_name},
                             Name{"--order-code", options.order_code, out.order_code}}) {
        if (name.given.size() > canopen::gateway::Identity::max_name) {
            fail(options, fmt::format("{} has {} bytes; at most {} are allowed", name.option,
                                      name.given.size(), canopen::gateway::Identity::max_name));

            return false;
        }
        if (!name.given.empty()) {
            name.to = name.given;
        }
    }
    return true;
}

}  // namespace

int run_can_gateway(const GatewayOptions& options) {
    if (!options.connect.empty()) return run_can_gateway_client(options);
    canopen::gateway::Identity identity;
    if (!read_identity(options, identity)) return 1;
    if (options.words.empty()) {
        return fail(options,
                    "missing ADDRESS; type: hal can gateway can:can0, or as a client: hal can "
                    "gateway --connect HOST:PORT");
    }
    if (!options.socket.empty() && !options.listen.empty()) {
        return fail(options, "--socket and --listen exclude each other");
    }
    StopRequest stop;
    std::vector<std::unique_ptr<can::Link>> links;
    for (const std::string& address : options.words) {
        can::Opened opened = can::open(address, {.receive_capacity = 16384});
        if (!opened) return fail(options, opened.problem);
        if (const std::string why = out_of_reach(opened.link->description()); !why.empty()) {
            return fail(options, why);
        }
        links.push_back(std::move(opened.link));
    }
    Listener listener;
    if (!(options.listen.empty() ? listen_locally(options, listener)
                                 : listen_on_port(options, listener))) {
        return 1;
    }
    std::string nets;
    for (std::size_t n = 0; n < links.size(); ++n) {
        nets += fmt::format("{}net {} is {}", n == 0 ? "" : ", ", n + 1,
                            links[n]->description().address);
    }
    write_all(STDERR_FILENO, fmt::format("{}: {}; listening on {}; press Ctrl-C to end\n",
                                         options.program, nets, listener.shown));
    return Server(options, links, stop, std::move(identity)).run(listener);
}

}  // namespace hal::tools
