// SPDX-License-Identifier: MIT
#include "ethercat/master/aoe_client.hpp"

#include <algorithm>
#include <cstring>

namespace hal::ethercat::master {
namespace {

// Number of the request, command.
bool accepts_aoe(const Expected& expected, std::span<const std::uint8_t> payload) noexcept {
    const auto header = aoe::read(payload);
    return header && header->response() && header->invoke == expected.first &&
           static_cast<std::uint32_t>(header->command) == expected.second;
}

void write_request(std::uint8_t* to, const AoeAddress& address, aoe::Command command,
                   std::uint32_t data, std::uint32_t invoke, std::uint32_t group,
                   std::uint32_t offset, std::uint32_t length) noexcept {
    aoe::Header header;
    header.target = address.target;
    header.target_port = address.target_port;
    header.source = address.source;
    header.source_port = address.source_port;
    header.command = command;
    header.length = data;
    header.invoke = invoke;
    aoe::write(to, header);
    put(to + aoe::header_bytes, group);
    put(to + aoe::header_bytes + 4, offset);

    put(to + aoe::header_bytes + 8, length);
}

}  // namespace

Task<MailboxResult> AoeClient::read(Channel& channel, BusSlave& slave, const AoeAddress& address,
                                    std::uint32_t group, std::uint32_t offset,
                                    std::span<std::uint8_t> to) noexcept {
    SlaveMailbox* mailbox = mailboxes_.find(slave);
    if (mailbox == nullptr) co_return refused();
    const SlaveMailbox::Hold hold = co_await mailbox->hold(channel);
    const auto body = mailbox->body(slave);
    constexpr std::size_t overhead =
        mailbox_header_bytes + aoe::header_bytes + aoe::read_response_bytes;
    if (body.size() < aoe::header_bytes + aoe::address_bytes || slave.area().in_size < overhead) {
        co_return refused();
    }
    const std::size_t max = std::min<std::size_t>(to.size(), slave.area().in_size - overhead);
    write_request(body.data(), address, aoe::Command::read, aoe::address_bytes, ++invoke_, group,
                  offset, static_cast<std::uint32_t>(max));
    const Expected expected{accepts_aoe, invoke_, static_cast<std::uint32_t>(aoe::Command::read)};
    const MailboxResult result = co_await mailbox->exchange(
        channel, slave, MailboxType::aoe, aoe::header_bytes + aoe::address_bytes, expected);
    if (!result) co_return result;
    const auto payload = mailbox->reply().payload;
    const std::uint32_t error = get<std::uint32_t>(payload.data() + 24);
    if (error != 0) co_return aborted(error);
    const auto data = payload.subspan(aoe::header_bytes);
    if (data.size() < 4) co_return refused();
    const std::uint32_t code = get<std::uint32_t>(data.data());
    if (code != 0) co_return aborted(code);
    if (data.size() < aoe::read_response_bytes) co_return refused();
    const std::size_t length = get<std::uint32_t>(data.data() + 4);
    if (length > data.size() - aoe::read_response_bytes || length > to.size()) {
        co_return refused(0, length);
    }
    if (length != 0) {
        std::memcpy(to.data(), data.data() + aoe::read_response_bytes, length);
    }
    co_return succeeded(length);
}

Task<MailboxResult> AoeClient::write(Channel& channel, BusSlave& slave, const AoeAddress& address,
                                     std::uint32_t group, std::uint32_t offset,
                                     std::span<const std::uint8_t> from) noexcept {
    SlaveMailbox* mailbox = mailboxes_.find(slave);
    if (mailbox == nullptr) co_return refused();
    const SlaveMailbox::Hold hold = co_await mailbox->hold(channel);
    const auto body = mailbox->body(slave);
    const std::size_t data_bytes = aoe::address_bytes + from.size();
    if (body.size() < aoe::header_bytes + data_bytes) co_return refused(0, from.size());
    write_request(body.data(), address, aoe::Command::write, static_cast<std::uint32_t>(data_bytes),
                  ++invoke_, group, offset, static_cast<std::uint32_t>(from.size()));
    if (!from.empty()) {
        std::memcpy(body.data() + aoe::header_bytes + aoe::address_bytes, from.data(), from.size());
    }
    const Expected expected{accepts_aoe, invoke_, static_cast<std::uint32_t>(aoe::Command::write)};
    const MailboxResult result = co_await mailbox->exchange(
        channel, slave, MailboxType::aoe, aoe::header_bytes + data_bytes, expected);
    if (!result) co_return result;
    const auto payload = mailbox->reply().payload;
    const std::uint32_t error = get<std::uint32_t>(payload.data() + 24);
    if (error != 0) co_return aborted(error);
    if (payload.size() < aoe::header_bytes + 4) co_return refused();
    const std::uint32_t code = get<std::uint32_t>(payload.data() + aoe::header_bytes);
    if (code != 0) co_return aborted(code);
    co_return succeeded(from.size());
}

}  // namespace hal::ethercat::master
