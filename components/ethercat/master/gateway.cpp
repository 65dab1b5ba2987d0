// SPDX-License-Identifier: MIT
#include "ethercat/master/gateway.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "ethercat/wire/frames.hpp"

namespace hal::ethercat::master {
namespace {

constexpr std::size_t max_message = ecat_header_bytes + max_mailbox;
constexpr std::size_t max_pending = 16;

// of the list for poll()
constexpr std::size_t udp_slot = 0;
constexpr std::size_t tcp_slot = 1;
constexpr std::size_t first_client_slot = 2;

int open_socket(int type, const std::string& address, std::uint16_t port, std::string& problem) {
    sockaddr_in at{};
    at.sin_family = AF_INET;
    at.sin_port = htons(port);
    const char* name = type == SOCK_STREAM ? "TCP" : "UDP";
    if (inet_pton(AF_INET, address.c_str(), &at.sin_addr) != 1) {
        problem = "mailbox gateway: '" + address +
                  "' is not an IPv4 address; write for example 127.0.0.1";
        return -1;
    }
    const int fd = socket(AF_INET, type | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    const int on = 1;
    if (fd >= 0 && type == SOCK_STREAM) {
        setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
    }
    if (fd < 0 || bind(fd, reinterpret_cast<const sockaddr*>(&at), sizeof at) != 0 ||
        (type == SOCK_STREAM && listen(fd, 8) != 0)) {
        problem = "mailbox gateway: cannot listen on " + address + ", " + name + " port " +
                  std::to_string(port) + ": ";
        problem += std::strerror(errno);
        if (fd >= 0) {
            close(fd);
        }
        return -1;
    }
    return fd;
}

}  // namespace

struct Gateway::Sender {
    sockaddr_in address{};
    std::uint32_t client = 0;  // of TCP; 0: UDP
};
struct Gateway::Client {
    int fd = -1;
    std::uint32_t id = 0;
    bool input_ended = false;  ///< it sends no more requests, but may still read replies
    std::size_t used = 0;
    std::array<std::uint8_t, max_message> bytes{};
};
struct Gateway::Pending {
    MailboxRequest request;
    Sender sender;
    std::chrono::steady_clock::time_point taken = std::chrono::steady_clock::now();
    std::array<std::uint8_t, max_mailbox> bytes{};
};

std::vector<GatewaySlave> GatewaySlaves::all() const {
    std::vector<GatewaySlave> slaves;
    const std::size_t count = count_;
    for (std::size_t n = 0; n < count; ++n) {
        const Row& row = rows_[n];
        const GatewaySlave s{row.station, row.number,   row.vendor,
                             row.product, row.revision, row.serial};
        if (s.station != 0 && row.station == s.station) {
            slaves.push_back(s);
        }
    }
    return slaves;
}

Gateway::Gateway(RequestPort& port, GatewaySetup setup, std::string& problem)
    : requests_(port), setup_(std::move(setup)) {
    problem.clear();
    udp_ = open_socket(SOCK_DGRAM, setup_.address, setup_.port, problem);
    if (udp_ < 0) return;
    sockaddr_in at{};
    socklen_t size = sizeof at;
    if (getsockname(udp_, reinterpret_cast<sockaddr*>(&at), &size) == 0) {
        number_ = ntohs(at.sin_port);
    }
    if (setup_.tcp) {
        tcp_ = open_socket(SOCK_STREAM, setup_.address, number_, problem);
    }
    if (setup_.tcp && tcp_ < 0) return;
    thread_ = std::thread([this] { run(); });
}

Gateway::~Gateway() {
    stop_ = true;
    if (thread_.joinable()) {
        thread_.join();
    }
    for (const auto& pending : pending_) {
        requests_.wait(pending->request);
    }
    for (const auto& client : clients_) {
        close(client->fd);
    }
    if (udp_ >= 0) {
        close(udp_);
    }
    if (tcp_ >= 0) {
        close(tcp_);
    }
}

void Gateway::run() {
    // Answers come from the cycle, which wakes nobody: while some are pending, look often.
    constexpr int idle_ms = 50;
    constexpr int pending_ms = 1;
    std::vector<pollfd> polled;
    while (!stop_) {
        list_polled(polled);
        ::poll(polled.data(), polled.size(), pending_.empty() ? idle_ms : pending_ms);
        forget_closed(polled[udp_slot], udp_);
        forget_closed(polled[tcp_slot], tcp_);
        if (polled[udp_slot].revents != 0) {
            read_udp();
        }
        for (std::size_t n = 0; n < clients_.size(); ++n) {
            serve(*clients_[n], polled[first_client_slot + n].revents);
        }
        std::erase_if(clients_, [](const auto& client) { return client->fd < 0; });
        if (polled[tcp_slot].revents != 0) {
            accept_client();
        }
        collect();
    }
}

/// Lists what poll() waits for: both sockets, of which poll() ignores a negative one, and the
/// clients in the order of clients_.
void Gateway::list_polled(std::vector<pollfd>& polled) const {
    polled.resize(first_client_slot);
    polled[udp_slot] = {udp_, POLLIN, 0};
    polled[tcp_slot] = {tcp_, POLLIN, 0};
    for (const auto& client : clients_) {
        const int events = client->input_ended ? 0 : POLLIN;
        polled.push_back({client->fd, static_cast<short>(events), 0});
    }
}

/// Forgets a socket that another part of the process has closed: poll() would not wait any more.
void Gateway::forget_closed(const pollfd& polled, int& fd) {
    if ((polled.revents & POLLNVAL) != 0) {
        fd = -1;
    }
}

/// Reads the requests of a client. Closes it when its connection is lost, and when it has ended its
/// input and has all its answers.
void Gateway::serve(Client& client, short events) {
    if ((events & POLLIN) != 0) {
        read_tcp(client);
    } else if (events != 0) {
        close(std::exchange(client.fd, -1));
    }
    const bool is_open = client.fd >= 0;
    if (is_open && client.input_ended && !is_waiting(client)) {
        close(std::exchange(client.fd, -1));
    }
}

void Gateway::accept_client() {
    const int fd = accept4(tcp_, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
    if (fd < 0) return;
    if (clients_.size() >= setup_.max_clients) {
        close(fd);
        return;
    }
    clients_.push_back(std::make_unique<Client>());
    clients_.back()->fd = fd;
    clients_.back()->id = next_client_++;
}

void Gateway::read_udp() {
    std::array<std::uint8_t, max_message + 1> bytes;
    Sender sender;
    for (unsigned max = 64; max != 0; --max) {
        socklen_t size = sizeof sender.address;
        const auto got = recvfrom(udp_, bytes.data(), bytes.size(), 0,
                                  reinterpret_cast<sockaddr*>(&sender.address), &size);
        if (got < 0) return;
        take({bytes.data(), static_cast<std::size_t>(got)}, sender);
    }
}

bool Gateway::is_waiting(const Client& client) const {
    return std::any_of(pending_.begin(), pending_.end(),
                       [&](const auto& pending) { return pending->sender.client == client.id; });
}

void Gateway::read_tcp(Client& client) {
    const auto got =
        recv(client.fd, client.bytes.data() + client.used, client.bytes.size() - client.used, 0);
    if (got < 0 && (errno == EAGAIN || errno == EINTR)) return;
    if (got == 0) {
        client.input_ended = true;
        return;
    }
    bool valid = got > 0;
    client.used += valid ? static_cast<std::size_t>(got) : 0;
    while (valid && client.used >= ecat_header_bytes) {
        const std::size_t length =
            ecat_header_bytes + (get<std::uint16_t>(client.bytes.data()) & 0x7ffU);
        valid = length <= client.bytes.size();  // else the stream cannot be followed any more
        if (!valid || client.used < length) break;
        Sender sender;
        sender.client = client.id;
        take({client.bytes.data(), length}, sender);
        std::memmove(client.bytes.data(), client.bytes.data() + length, client.used -= length);
    }
    if (!valid) {
        close(std::exchange(client.fd, -1));
    }
}

void Gateway::take(std::span<const std::uint8_t> bytes, const Sender& sender) {
    const std::uint16_t header =
        bytes.size() < ecat_header_bytes ? 0 : get<std::uint16_t>(bytes.data());
    const std::size_t length = header & 0x7ffU;
    const bool fits = header >> 12 == static_cast<unsigned>(Protocol::mailbox_gateway) &&
                      ecat_header_bytes + length <= bytes.size() && length <= max_mailbox;
    const auto message =
        fits ? read_mailbox(bytes.subspan(ecat_header_bytes, length)) : std::nullopt;
    if (!message || pending_.size() >= max_pending) {
        ++dropped_;
        return;
    }
    auto pending = std::make_unique<Pending>();
    std::copy_n(bytes.data() + ecat_header_bytes, length, pending->bytes.data());
    const std::vector<GatewaySlave> slaves = setup_.slaves();
    if (message->station == 0) {
        const std::size_t reply = answer_for_master(slaves, pending->bytes, length);
        if (reply != 0) {
            answer(sender, std::span(pending->bytes).first(reply));
        } else {
            ++dropped_;
        }
        return;
    }
    const auto slave = std::find_if(slaves.begin(), slaves.end(),
                                    [&](const auto& s) { return s.station == message->station; });
    pending->sender = sender;
    MailboxRequest& request = pending->request;
    request.kind = MailboxRequest::Kind::message;
    request.data = pending->bytes;
    request.length = length;
    if (slave != slaves.end()) {
        request.slave = slave->number;
    }
    if (slave == slaves.end() || !requests_.submit(request)) {
        ++dropped_;
    } else {
        pending_.push_back(std::move(pending));
    }
}

void Gateway::collect() {
    std::erase_if(pending_, [this](const auto& pending) {
        // the cycle does not run: begun later, it would write what nobody expects any more
        if (std::chrono::steady_clock::now() - pending->taken > setup_.max_wait) {
            requests_.withdraw(pending->request);
        }
        if (!requests_.finished(pending->request)) return false;
        const MailboxResult& result = pending->request.result;
        if (result) {
            answer(pending->sender, std::span(pending->bytes).first(result.length));
        } else {
            ++dropped_;  // the protocol has no answer for this: clients have their own timeout
        }
        return true;
    });
}

void Gateway::answer(const Sender& sender, std::span<const std::uint8_t> message) {
    std::array<std::uint8_t, max_message> bytes;
    put(bytes.data(), static_cast<std::uint16_t>(
                          message.size() | static_cast<unsigned>(Protocol::mailbox_gateway) << 12));
    std::copy(message.begin(), message.end(), bytes.begin() + ecat_header_bytes);
    const std::size_t length = ecat_header_bytes + message.size();
    ssize_t sent = -1;
    if (sender.client == 0) {
        sent = sendto(udp_, bytes.data(), length, 0,
                      reinterpret_cast<const sockaddr*>(&sender.address), sizeof sender.address);
    } else {
        const auto client = std::find_if(clients_.begin(), clients_.end(), [&](const auto& c) {
            return c->id == sender.client && c->fd >= 0;
        });
        if (client != clients_.end()) {
            sent = send((*client)->fd, bytes.data(), length, MSG_NOSIGNAL);
            // a part would end the framing
            if (sent != static_cast<ssize_t>(length)) {
                shutdown((*client)->fd, SHUT_RDWR);
            }
        }
    }
    ++(sent == static_cast<ssize_t>(length) ? answered_ : dropped_);
}

}  // namespace hal::ethercat::master
