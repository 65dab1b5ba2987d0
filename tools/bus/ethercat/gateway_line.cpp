// SPDX-License-Identifier: MIT
#include "bus/ethercat/gateway_line.hpp"

#include <algorithm>
#include <arpa/inet.h>
#include <cerrno>
#include <cstring>
#include <fmt/core.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include "ethercat/wire/coe.hpp"
#include "ethercat/wire/frames.hpp"
#include "ethercat/wire/mailbox.hpp"
#include "ethercat/wire/registers.hpp"
#include "hal/clock.hpp"
#include "text/numbers.hpp"

namespace hal::tools {

using namespace ethercat;
using master::BusSlave;

namespace {

constexpr std::uint16_t gateway_port = 34980;
constexpr std::uint16_t request_area = 0x1000;
constexpr std::uint16_t reply_area = 0x1400;
// every slave takes messages of this size; longer values go in segments
constexpr std::uint16_t small_mailbox = 34;
constexpr std::uint8_t mailbox_full = 0x08;
constexpr int answer_timeout_ms = 2000;

}  // namespace

GatewayLine::~GatewayLine() {
    if (fd_ >= 0) {
        ::close(fd_);
    }
}

std::string GatewayLine::open(const std::string& address) {
    const std::string endpoint = address.substr(address.find(':') + 1);
    const std::size_t colon = endpoint.find(':');
    const std::string host = endpoint.substr(0, colon);
    sockaddr_in at{};
    at.sin_family = AF_INET;
    at.sin_port = htons(gateway_port);
    const auto port = colon == std::string::npos ? std::optional<std::uint64_t>(gateway_port)
                                                 : parse_natural(endpoint.substr(colon + 1));
    if (inet_pton(AF_INET, host.c_str(), &at.sin_addr) != 1 || !port || *port == 0 ||
        *port > 65535) {
        return fmt::format(
            "invalid address '{}'; write gateway:127.0.0.1 or gateway:127.0.0.1:34980", address);
    }
    at.sin_port = htons(static_cast<std::uint16_t>(*port));
    fd_ = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    if (fd_ < 0 || ::connect(fd_, reinterpret_cast<const sockaddr*>(&at), sizeof at) != 0) {
        const int why = errno;
        const std::string help =
            why == ECONNREFUSED
                ? "; write gateway = 127.0.0.1 in [bus] of the configuration, and start the machine"
                : "";
        return fmt::format("no mailbox gateway at {}:{}: {}{}", host, *port, std::strerror(why),
                           help);
    }
    const auto no_answer = fmt::format(
        "the gateway at {}:{} does not list its slaves; is it one of ETG.8200?", host, *port);
    for (std::uint16_t list = 0; list < 16; ++list) {
        const auto count = master_value(static_cast<std::uint16_t>(0xf020 + list), 0);
        if (!count) return no_answer;
        for (std::uint32_t n = 1; n <= *count; ++n) {
            const auto station = master_value(static_cast<std::uint16_t>(0xf020 + list),
                                              static_cast<std::uint8_t>(n));
            if (!station) return no_answer;
            BusSlave s;
            s.number = s.position = static_cast<std::uint16_t>(slaves_.size());
            s.station = static_cast<std::uint16_t>(*station);
            s.present = true;

            s.state = State::preop;
            s.mailbox = {request_area, small_mailbox, reply_area,
                         static_cast<std::uint16_t>(max_mailbox)};
            s.protocols = ethercat::bit_of(ethercat::MailboxType::coe);
            slaves_.push_back(s);
        }
        if (*count < 255) break;
    }
    return slaves_.empty()
               ? fmt::format("the master behind {}:{} has found no slave yet; look at its log",
                             host, *port)
               : "";
}

bool GatewayLine::send(std::uint16_t station, std::span<std::uint8_t> message) {
    std::vector<std::uint8_t> bytes(ecat_header_bytes + message.size());
    put(bytes.data(), static_cast<std::uint16_t>(
                          message.size() | static_cast<unsigned>(Protocol::mailbox_gateway) << 12));
    put(message.data() + 2, station);  // of the header of the mailbox
    std::copy(message.begin(), message.end(), bytes.begin() + ecat_header_bytes);
    return ::send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL) ==
           static_cast<ssize_t>(bytes.size());
}

void GatewayLine::read(int timeout_ms) {
    pollfd polled{fd_, POLLIN, 0};
    if (closed_ || ::poll(&polled, 1, timeout_ms) <= 0) return;
    std::uint8_t bytes[4096];
    const auto got = ::recv(fd_, bytes, sizeof bytes, MSG_DONTWAIT);
    if (got == 0 || (got < 0 && errno != EAGAIN && errno != EINTR)) {
        closed_ = true;
    }
    if (got <= 0) return;
    received_.insert(received_.end(), bytes, bytes + got);
    while (received_.size() >= ecat_header_bytes) {
        const std::size_t length =
            ecat_header_bytes + (get<std::uint16_t>(received_.data()) & 0x7ffU);
        if (received_.size() < length) return;
        const auto message = read_mailbox(
            std::span(received_).subspan(ecat_header_bytes, length - ecat_header_bytes));
        if (message) {
            replies_.push_back({message->station,
                                {received_.begin() + ecat_header_bytes,
                                 received_.begin() + static_cast<std::ptrdiff_t>(length)}});
        }
        received_.erase(received_.begin(), received_.begin() + static_cast<std::ptrdiff_t>(length));
    }
}

void GatewayLine::receive() { read(1); }

std::vector<GatewayLine::Reply>::iterator GatewayLine::reply_of(std::uint16_t station) {
    return std::find_if(replies_.begin(), replies_.end(),
                        [&](const Reply& r) { return r.station == station; });
}

std::optional<std::uint32_t> GatewayLine::master_value(std::uint16_t index, std::uint8_t sub) {
    std::vector<std::uint8_t> message(mailbox_header_bytes + coe::sdo_bytes);
    write_mailbox_header(message.data(), coe::sdo_bytes, 0, MailboxType::coe, 1);
    coe::write_sdo(message.data() + mailbox_header_bytes, coe::Service::sdo_request,
                   {coe::command::upload, index, sub, 0});
    if (!send(0, message)) return std::nullopt;
    for (const std::int64_t until = monotonic_ns() + answer_timeout_ms * 1'000'000LL;
         monotonic_ns() < until && !closed_;) {
        read(10);
        const auto reply = reply_of(0);
        if (reply == replies_.end()) continue;
        const auto got = read_mailbox(reply->message);
        const auto sdo =
            got && got->type == MailboxType::coe ? coe::read_sdo(got->payload) : std::nullopt;
        replies_.erase(reply);
        if (!sdo || !sdo->is(coe::command::upload_response) || !sdo->expedited() ||
            sdo->index != index || sdo->sub != sub) {
            return std::nullopt;
        }
        const auto unused = static_cast<unsigned>(8 * (4 - sdo->expedited_bytes()));
        return sdo->value << unused >> unused;
    }
    return std::nullopt;
}

void GatewayLine::serve(master::Channel& channel, std::int64_t now_ns) {
    using Stage = master::Channel::Stage;
    channel.set_now(now_ns);
    if (channel.stage() == Stage::sleeping && now_ns >= channel.until_ns()) {
        channel.wake();
    }
    if (channel.stage() != Stage::waiting) return;
    if (closed_) return channel.lose();
    const auto station = static_cast<std::uint16_t>(channel.address());
    const auto area = static_cast<std::uint16_t>(channel.address() >> 16);
    const auto reply = reply_of(station);
    const bool full = reply != replies_.end();
    if (area == request_area) {
        const auto request = read_mailbox(std::span(channel.data(), channel.length()));
        if (!request ||
            !send(station, {channel.data(), mailbox_header_bytes + request->payload.size()})) {
            return channel.lose();
        }
    } else {
        std::memset(channel.data(), 0, channel.length());
        if (area == reply_area && full) {
            std::memcpy(channel.data(), reply->message.data(),
                        std::min<std::size_t>(reply->message.size(), channel.length()));
            replies_.erase(reply);
        } else if (area == registers::sync_manager_at(1) + 5 && full) {
            channel.data()[0] = mailbox_full;
        }
    }
    channel.arrive(1);
}

}  // namespace hal::tools
