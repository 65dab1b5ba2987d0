// SPDX-License-Identifier: MIT
#include "bus/mesa/card_client.hpp"

#include <algorithm>
#include <array>

#include "link/system.hpp"

namespace hal::tools {

using namespace mesa;

std::string CardClient::open(const std::string& host, std::int64_t timeout_ns) {
    host_ = host;
    timeout_ns_ = timeout_ns;
    auto opened = datagram::open(datagram::describe(host).transport.empty() ? "eth:" + host : host,
                                 {.port = udp_port});
    if (!opened) return opened.problem;
    port_ = std::move(opened.port);
    return {};
}

void CardClient::discard() {
    std::array<std::uint8_t, datagram::max_size> rest;
    while (port_->receive(rest, datagram::unclocked) != 0) {
    }
}

bool CardClient::send(const Request& request) {
    return port_->send(request.bytes(), datagram::unclocked);
}

std::optional<std::vector<std::uint8_t>> CardClient::receive(std::int64_t limit_ns) {
    std::vector<std::uint8_t> reply(datagram::max_size);
    for (;;) {
        const std::size_t size = port_->receive(reply, datagram::unclocked);
        if (size > 0) {
            reply.resize(size);
            return reply;
        }
        const std::int64_t left_ns = limit_ns - link::monotonic_ns();
        if (left_ns <= 0 || !port_->wait(left_ns)) return std::nullopt;
    }
}

std::optional<std::vector<std::uint8_t>> CardClient::ask(const Request& request, int count) {
    std::vector<std::uint8_t> reply(datagram::max_size);
    for (int n = 0; n < count; ++n) {
        discard();
        const bool is_sent = send(request);
        if (request.reply_size() == 0) {
            if (is_sent) return std::vector<std::uint8_t>();
            continue;
        }
        const std::int64_t limit_ns = link::monotonic_ns() + timeout_ns_;
        for (std::int64_t left = timeout_ns_; left > 0; left = limit_ns - link::monotonic_ns()) {
            if (!port_->wait(left)) break;
            const std::size_t size = port_->receive(reply, datagram::unclocked);
            if (size != request.reply_size()) continue;
            reply.resize(size);
            return reply;
        }
    }
    return std::nullopt;
}

std::optional<std::vector<std::uint8_t>> CardClient::read(Space space, std::uint16_t address,
                                                          Unit unit, std::size_t count) {
    constexpr std::size_t batch = max_units;
    std::vector<std::uint8_t> all;
    for (std::size_t done = 0; done < count; done += batch) {
        Request request;
        request.read(space, static_cast<std::uint16_t>(address + done * bytes_of(unit)), unit,
                     std::min(batch, count - done));
        const auto part = ask(request);
        if (!part) return std::nullopt;
        all.insert(all.end(), part->begin(), part->end());
    }
    return all;
}

std::string CardClient::silence() const {
    const std::string& remark = port_->description().remark;
    if (!remark.empty()) return host_ + " does not answer: " + remark;
    return host_ +
           " does not answer; check power, cable and the jumpers of its address, and type: "
           "ping " +
           host_.substr(0, host_.find(':'));
}

}  // namespace hal::tools
