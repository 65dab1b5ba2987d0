// SPDX-License-Identifier: MIT
#include "control/client_list.hpp"

#include <algorithm>
#include <cerrno>
#include <utility>

#include <sys/socket.h>
#include <unistd.h>

#include "hal/clock.hpp"

namespace hal {

std::size_t ClientList::count(bool placed) const {
    return static_cast<std::size_t>(std::count_if(
        clients_.begin(), clients_.end(),
        [&](const auto& client) { return !client->gone && client->placed == placed; }));
}

bool ClientList::listens_to(const ServedClient& client) const {
    return !client.input_ended && !client.told_end && client.waiting() <= options_.queue &&
           client.in.size() - client.taken <= options_.max_request;
}

void ClientList::log(const std::string& sentence) const {
    if (options_.log) {
        options_.log(sentence);
    }
}

void ClientList::leave(ServedClient& client) {
    client.gone = true;
    client.connection->cancel();
    ::close(std::exchange(client.fd, -1));
    if (client.process >= 0) {
        ::close(std::exchange(client.process, -1));
    }
}

void ClientList::send_out(ServedClient& client) {
    const std::size_t before = client.sent;
    while (client.waiting() > 0) {
        const ssize_t gone = send(client.fd, client.out.data() + client.sent, client.waiting(),
                                  MSG_NOSIGNAL | MSG_DONTWAIT);
        if (gone < 0 && errno == EINTR) continue;
        if (gone < 0 && errno != EAGAIN && errno != EWOULDBLOCK) return leave(client);
        if (gone <= 0) break;
        client.sent += static_cast<std::size_t>(gone);
    }
    const bool moved = client.sent != before;
    if (client.waiting() == 0) {
        client.out.clear();
        if (client.out.capacity() > options_.queue) {
            client.out.shrink_to_fit();
        }
        client.sent = 0;
    } else if (client.sent > options_.queue) {
        client.out.erase(0, client.sent);
        client.sent = 0;
    }
    if (client.waiting() <= options_.queue || moved) {
        client.stalled_since = client.waiting() > options_.queue ? monotonic_ns() : 0;
        return;
    }
    const std::int64_t now = monotonic_ns();
    if (client.stalled_since == 0) {
        client.stalled_since = now;
    }
    if (now - client.stalled_since < std::int64_t{options_.stall_ms} * 1'000'000) return;
    ++dropped;
    log("disconnected a client: " + std::to_string(client.waiting()) +
        " bytes of replies pending, nothing read for " + std::to_string(options_.stall_ms) + " ms");
    leave(client);
}

void ClientList::close(ServedClient& client, const std::string& reason) {
    client.out += "{\"event\":\"closed\",\"reason\":\"" + reason + "\"}\n";
    send_out(client);
    if (client.gone) return;
    shutdown(client.fd, SHUT_RDWR);
    leave(client);
}

}  // namespace hal
