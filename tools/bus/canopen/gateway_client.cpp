// SPDX-License-Identifier: MIT
// `hal can gateway --connect`: a client of a CiA 309-3 gateway. It adds the sequence numbers and
// prints error texts.
#include "bus/canopen/gateway.hpp"

#include <algorithm>
#include <charconv>
#include <fmt/core.h>
#include <netdb.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <optional>

#include "bus/can/bus.hpp"
#include "canopen/master/gateway/gateway_command.hpp"
#include "cli/output.hpp"
#include "cli/prompt_loop.hpp"
#include "text/characters.hpp"

namespace hal::tools {

namespace {

struct TcpEndpoint {
    std::string host;
    std::string port;
};

/// HOST:PORT. Nothing for the path of a socket.
std::optional<TcpEndpoint> tcp_endpoint(const std::string& endpoint) {
    const auto colon = endpoint.rfind(':');
    if (colon == endpoint.npos || endpoint.find('/') != endpoint.npos) return std::nullopt;
    const std::string port = endpoint.substr(colon + 1);
    const bool is_number = !port.empty() && port.find_first_not_of("0123456789") == port.npos;
    if (!is_number) return std::nullopt;
    return TcpEndpoint{endpoint.substr(0, colon), port};
}

/// Connects a stream socket. Returns -1 with the reason in errno.
int connect_to(const sockaddr* address, socklen_t size) {
    const int fd = ::socket(address->sa_family, SOCK_STREAM | SOCK_CLOEXEC, 0);
    if (fd < 0) return -1;
    if (::connect(fd, address, size) == 0) return fd;
    const int error = errno;
    ::close(fd);
    errno = error;
    return -1;
}

void report_unconnected(const GatewayOptions& options, int error, const char* listening_option) {
    fail(options,
         fmt::format("cannot connect to the gateway at '{}': {}; start one with: hal can "
                     "gateway ADDRESS {} {}",
                     options.connect, std::strerror(error), listening_option, options.connect));
}

/// Connects to the first address of the host that accepts. Returns -1 after printing the reason.
int connect_tcp(const GatewayOptions& options, const TcpEndpoint& endpoint) {
    addrinfo hints{};
    hints.ai_socktype = SOCK_STREAM;
    addrinfo* addresses = nullptr;
    const int problem =
        ::getaddrinfo(endpoint.host.c_str(), endpoint.port.c_str(), &hints, &addresses);
    if (problem != 0) {
        fail(options,
             fmt::format("invalid --connect '{}': {}; write HOST:PORT, such as 127.0.0.1:6000",
                         options.connect, ::gai_strerror(problem)));
        return -1;
    }
    int fd = -1;
    int error = 0;
    for (const addrinfo* address = addresses; address && fd < 0; address = address->ai_next) {
        fd = connect_to(address->ai_addr, address->ai_addrlen);
        error = errno;
    }
    ::freeaddrinfo(addresses);
    if (fd < 0) {
        report_unconnected(options, error, "--listen");
    }
    return fd;
}

/// Connects to a socket in the file system. Returns -1 after printing the reason.
int connect_unix(const GatewayOptions& options) {
    const std::string& path = options.connect;
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    if (path.size() >= sizeof address.sun_path) {
        fail(options, fmt::format("path too long for a socket: '{}'", path));
        return -1;
    }
    std::memcpy(address.sun_path, path.c_str(), path.size() + 1);
    const int fd = connect_to(reinterpret_cast<const sockaddr*>(&address), sizeof address);
    if (fd < 0) {
        report_unconnected(options, errno, "--socket");
    }
    return fd;
}

/// Connects a socket; returns -1 after printing the reason.
int connect_to_gateway(const GatewayOptions& options) {
    const std::optional<TcpEndpoint> tcp = tcp_endpoint(options.connect);
    return tcp ? connect_tcp(options, *tcp) : connect_unix(options);
}

/// Formats `1 5 EMCY … #life guard error`: net and node by name, the comment as part of the
/// sentence.
std::string event_text(std::string_view line) {
    std::string text(line);
    if (const auto mark = text.find(" #"); mark != text.npos) {
        text.replace(mark, 2, ": ");
    }
    unsigned net = 0;
    unsigned node = 0;
    const char* const end = text.data() + text.size();
    const auto after_net = std::from_chars(text.data(), end, net);
    if (after_net.ec != std::errc() || after_net.ptr == end || *after_net.ptr != ' ') return text;
    const auto after_node = std::from_chars(after_net.ptr + 1, end, node);
    if (after_node.ec != std::errc() || after_node.ptr == end) {
        return fmt::format("net {}: {}", net, after_net.ptr + 1);
    }
    return fmt::format("net {}, node {}: {}", net, node, after_node.ptr + 1);
}

/// Formats `ERROR:105 #no default node set` as "no default node set (error 105); …".
std::string error_text(std::string_view answer) {
    const auto mark = answer.find('#');
    const std::string_view begins = "ERROR:";
    std::string number(
        answer.substr(begins.size(), mark == answer.npos ? mark : mark - begins.size()));
    while (number.ends_with(' ')) {
        number.pop_back();
    }
    const bool abort = number.starts_with("0x");
    std::string text = abort ? "SDO abort" : "error";
    if (mark != answer.npos) {
        text = answer.substr(mark + 1);
    }
    text += abort ? fmt::format(" ({})", number) : fmt::format(" (error {})", number);
    if (number == "104") {
        text += "; write the net before the command, or type: set network NET";
    }
    if (number == "105") {
        text += "; write the node before the command, or type: set node NODE";
    }
    return text;
}

/// Joins the words of the command line to one line of CiA 309-3.
std::string joined(std::span<const std::string> words) {
    std::string line;
    for (const std::string& word : words) {
        if (!line.empty()) {
            line += ' ';
        }
        if (!word.empty() && word.find_first_of(" \t#\"") == word.npos) {
            line += word;
            continue;
        }
        line += '"';
        for (const char c : word) {
            line += c == '"' ? "\"\"" : std::string(1, c);
        }
        line += '"';
    }
    return line;
}

class GatewaySession final : public LineExecutor {
public:
    GatewaySession(const GatewayOptions& options, int fd, StopRequest& stop, bool events)
        : options_(options), fd_(fd), stop_(stop), events_(events) {}
    ~GatewaySession() override { ::close(fd_); }

    int execute(std::string_view text) override {
        const std::string_view command = trimmed(text);
        if (command.empty() || command.front() == '#') return 0;
        if (command == "quit" || command == "exit") {
            over_ = true;
            return 0;
        }
        if (command.front() == '[') {
            return fail(
                options_,
                fmt::format("'{}': sequence numbers are added here; type the command without one",
                            command));
        }
        const int status = send_command(command);
        const bool is_listing_next = status == 0 && command == "help";
        return is_listing_next ? receive_listing() : status;
    }
    Completion complete(std::string_view line, std::size_t cursor) override {
        Completion out;
        line = line.substr(0, cursor);
        const auto blank = line.find_last_of(' ');
        out.begin = blank == line.npos ? 0 : blank + 1;
        constexpr const char* known[] = {"boot_up_indication",
                                         "disable",
                                         "enable",
                                         "guarding",
                                         "heartbeat",
                                         "help",
                                         "info",
                                         "init",
                                         "lss_activate_bitrate",
                                         "lss_conf_bitrate",
                                         "lss_get_node",
                                         "lss_ident_nonconf",
                                         "lss_identity",
                                         "lss_inquire_addr",
                                         "lss_set_node",
                                         "lss_store",
                                         "lss_switch_glob",
                                         "lss_switch_sel",
                                         "network",
                                         "node",
                                         "preop",
                                         "quit",
                                         "read",
                                         "reset",
                                         "restore",
                                         "set",
                                         "start",
                                         "stop",
                                         "store",
                                         "version",
                                         "write"};
        for (const char* word : known) {
            if (std::string_view(word).starts_with(line.substr(out.begin))) {
                out.candidates.push_back({word, {}});
            }
        }
        return out;
    }
    bool collecting() const override { return false; }
    bool over() const override { return over_ || stop_.requested(); }
    std::function<void()> meanwhile() override {
        return [this] {
            std::string answer;
            while (!over_ && readable(0)) {
                take(0, answer);
            }
        };
    }

private:
    /// Sends a command and prints its response. Returns the exit status.
    int send_command(std::string_view command) {
        std::string answer;
        if (!ask(command, answer)) return 1;
        if (answer.starts_with("ERROR:")) {
            return fail(options_, fmt::format("{}: {}", command, error_text(answer)));
        }
        if (!print(answer + "\n")) {
            over_ = true;
            return 1;
        }
        return 0;
    }
    /// Prints the lines that follow the response to `help`. Nothing marks the last one, so they end
    /// with the response to another command. Returns the exit status.
    int receive_listing() {
        std::string version;
        listing_ = true;
        const bool is_complete = ask("info version", version);
        listing_ = false;
        return exit_code(is_complete);
    }
    /// Waits for the response to a command. Returns false after printing the reason.
    bool ask(std::string_view text, std::string& answer) {
        constexpr std::int64_t limit = 60'000'000'000;
        const std::uint32_t number = ++sequence_;
        const std::string line = fmt::format("[{}] {}\r\n", number, text);
        for (std::size_t sent = 0; sent < line.size();) {
            const ssize_t now = ::send(fd_, line.data() + sent, line.size() - sent, MSG_NOSIGNAL);
            if (now < 0 && errno == EINTR) continue;
            if (now < 0) return lost();
            sent += static_cast<std::size_t>(now);
        }
        for (const std::int64_t end = monotonic_ns() + limit; monotonic_ns() < end;) {
            if (stop_.requested()) {
                fail(options_,
                     fmt::format("interrupted while waiting for the response to '{}'", text));

                return false;
            }
            if (!readable(100)) continue;
            if (take(number, answer)) return true;
            if (over_) return false;
        }
        fail(options_,
             fmt::format("no response to '{}' within 60 s; check that the gateway is running",
                         text));

        return false;
    }
    bool readable(int ms) {
        if (in_.find('\n') != in_.npos) return true;
        pollfd all[2] = {{fd_, POLLIN, 0}, {stop_.fd(), POLLIN, 0}};
        return ::poll(all, 2, ms) > 0 && all[0].revents != 0;
    }
    bool lost() {
        over_ = true;
        fail(options_, fmt::format("the gateway at '{}' closed the connection", options_.connect));

        return false;
    }
    /// Reads pending lines and prints events. Returns true when `answer` is the response to
    /// `number`.
    bool take(std::uint32_t number, std::string& answer) {
        if (in_.find('\n') == in_.npos) {
            char bytes[65536];
            const ssize_t got = ::recv(fd_, bytes, sizeof bytes, 0);
            if (got < 0 && errno == EINTR) return false;
            if (got <= 0) return lost();
            in_.append(bytes, static_cast<std::size_t>(got));
        }
        const std::string expected = fmt::format("[{}] ", number);
        for (std::size_t end; (end = in_.find('\n')) != in_.npos;) {
            std::string line = in_.substr(0, end);
            in_.erase(0, end + 1);
            if (line.ends_with('\r')) {
                line.pop_back();
            }
            if (number != 0 && line.starts_with(expected)) {
                answer = line.substr(expected.size());
                return true;
            }
            if (line.starts_with("# ") && listing_) {
                print(line.substr(2) + "\n");
            } else if (!line.starts_with("[") && !line.starts_with("#") && events_) {
                print(event_text(line) + "\n");
            }
        }
        return false;
    }

    const GatewayOptions& options_;
    const int fd_;
    StopRequest& stop_;
    const bool events_;
    bool over_ = false;
    bool listing_ = false;
    std::uint32_t sequence_ = 0;
    std::string in_;
};

}  // namespace

int run_can_gateway_client(const GatewayOptions& options) {
    if (!options.socket.empty() || !options.listen.empty() || !options.state.empty()) {
        return fail(
            options,
            "--connect is for a client; --socket, --listen and --state are for the gateway");
    }
    if (!options.identity.empty() || !options.vendor_name.empty() ||
        !options.product_name.empty() || !options.order_code.empty()) {
        return fail(options,
                    "--connect is for a client; --identity, --vendor-name, --product-name and "
                    "--order-code are for the gateway");
    }
    StopRequest stop;
    const int fd = connect_to_gateway(options);
    if (fd < 0) return 1;
    GatewaySession session(options, fd, stop, options.words.empty());
    if (options.words.empty()) {
        const bool terminal = ::isatty(STDIN_FILENO) == 1;
        if (terminal) {
            print(fmt::format("connected to {}; type 'help' for the commands, Tab completes\n",
                              options.connect));
        }
        return run_prompt_loop(session, {"gateway> ", "gateway> "}, stop.fd());
    }
    if (options.words.front().find(' ') == options.words.front().npos) {
        return session.execute(joined(options.words));
    }
    for (const std::string& line : options.words) {
        if (session.execute(line) != 0 || session.over()) return 1;
    }
    return 0;
}

}  // namespace hal::tools
