// SPDX-License-Identifier: MIT
#include "ethercat/master/foe_client.hpp"

#include <algorithm>
#include <cstring>

namespace hal::ethercat::master {
namespace {

constexpr std::int64_t busy_pause_ns = 100'000'000;

// Operation, packet. Duplicates of earlier answers are not accepted, a number that is too large is:
// it ends the transfer.
bool accepts_foe(const Expected& expected, std::span<const std::uint8_t> payload) noexcept {
    const auto message = foe::read(payload);
    if (!message) return false;
    if (message->opcode == foe::Opcode::error || message->opcode == foe::Opcode::busy) return true;
    return static_cast<std::uint32_t>(message->opcode) == expected.first &&
           message->value >= expected.second;
}

std::size_t write_name(std::span<std::uint8_t> body, foe::Opcode opcode, std::uint32_t password,
                       std::string_view name) noexcept {
    foe::write_header(body.data(), opcode, password);
    if (!name.empty()) {
        std::memcpy(body.data() + foe::header_bytes, name.data(), name.size());
    }
    return foe::header_bytes + name.size();
}

}  // namespace

Task<MailboxResult> FoeClient::exchange(Channel& channel, BusSlave& slave, SlaveMailbox& mailbox,
                                        std::size_t length, foe::Opcode answer,
                                        std::uint32_t packet, FoeOptions options,
                                        FoeProgress& progress) noexcept {
    const std::int64_t timeout = std::int64_t{options.timeout_ms} * 1'000'000;
    std::int64_t give_up = channel.now_ns() + std::int64_t{options.busy_ms} * 1'000'000;
    const Expected expected{accepts_foe, static_cast<std::uint32_t>(answer), packet};
    MailboxResult result = co_await mailbox.send(channel, slave, MailboxType::foe, length);
    if (!result) co_return result;
    bool busy = false;
    for (;;) {
        result = co_await mailbox.wait_for(channel, slave, MailboxType::foe,
                                           busy ? busy_pause_ns : timeout, expected);
        // the slave waits for the same packet
        if (busy && result.outcome == MailboxResult::Outcome::timed_out) {
            if (channel.now_ns() >= give_up) co_return result;
            mailbox.still_waiting();
            busy = false;
            result = co_await mailbox.send(channel, slave, MailboxType::foe, length);
            if (!result) co_return result;
            continue;
        }
        if (!result) co_return result;
        const foe::Message message = *foe::read(mailbox.reply().payload);
        if (message.opcode == foe::Opcode::busy) {
            if (message.done() != progress.done) {
                give_up = channel.now_ns() + std::int64_t{options.busy_ms} * 1'000'000;
            }
            progress.done = message.done();
            progress.entire = message.entire();
            busy = true;
            continue;
        }
        if (message.opcode == foe::Opcode::error) {
            const std::size_t bytes = std::min(message.data.size(), progress.text.size() - 1);
            if (bytes != 0) {
                std::memcpy(progress.text.data(), message.data.data(), bytes);
            }
            progress.text[bytes] = '\0';
            co_return aborted(message.value);
        }
        if (message.value == packet) co_return succeeded(message.data.size());
        const auto code = static_cast<std::uint32_t>(foe::Error::packet_number);
        foe::write_header(mailbox.body(slave).data(), foe::Opcode::error, code);
        co_await mailbox.send(channel, slave, MailboxType::foe, foe::header_bytes);
        co_return aborted(code);
    }
}

Task<MailboxResult> FoeClient::read(Channel& channel, BusSlave& slave, std::string_view name,
                                    FoeOptions options, std::span<std::uint8_t> to,
                                    FoeProgress& progress) noexcept {
    SlaveMailbox* mailbox = mailboxes_.find(slave);
    if (mailbox == nullptr) co_return refused();
    const SlaveMailbox::Hold hold = co_await mailbox->hold(channel);
    const auto body = mailbox->body(slave);
    const std::size_t in_size = slave.area().in_size;
    if (body.size() < foe::header_bytes + name.size() ||
        in_size <= mailbox_header_bytes + foe::header_bytes) {
        co_return refused();
    }
    const std::size_t capacity = foe::packet_capacity(in_size);
    std::size_t length = write_name(body, foe::Opcode::read, options.password, name);
    std::size_t used = 0;
    for (std::uint32_t packet = 1;; ++packet) {
        const MailboxResult result = co_await exchange(
            channel, slave, *mailbox, length, foe::Opcode::data, packet, options, progress);
        if (!result) co_return result;
        const auto data = foe::read(mailbox->reply().payload)->data;
        if (data.size() > to.size() - used) {
            foe::write_header(body.data(), foe::Opcode::error,
                              static_cast<std::uint32_t>(foe::Error::disk_full));
            co_await mailbox->send(channel, slave, MailboxType::foe, foe::header_bytes);
            co_return refused(0, used + data.size());
        }
        if (!data.empty()) {
            std::memcpy(to.data() + used, data.data(), data.size());
        }
        used += data.size();
        progress.bytes = static_cast<std::uint32_t>(used);
        foe::write_header(body.data(), foe::Opcode::ack, packet);
        length = foe::header_bytes;
        if (data.size() < capacity) {
            co_await mailbox->send(channel, slave, MailboxType::foe, length);
            co_return succeeded(used);
        }
    }
}

Task<MailboxResult> FoeClient::write(Channel& channel, BusSlave& slave, std::string_view name,
                                     FoeOptions options, std::span<const std::uint8_t> from,
                                     FoeProgress& progress) noexcept {
    SlaveMailbox* mailbox = mailboxes_.find(slave);
    if (mailbox == nullptr) co_return refused();
    const SlaveMailbox::Hold hold = co_await mailbox->hold(channel);
    const auto body = mailbox->body(slave);
    if (body.size() <= foe::header_bytes || body.size() < foe::header_bytes + name.size()) {
        co_return refused();
    }
    const std::size_t capacity = body.size() - foe::header_bytes;
    std::size_t length = write_name(body, foe::Opcode::write, options.password, name);
    std::size_t used = 0;

    std::size_t last = capacity;
    // ends with a packet that is not full, an empty one if need be
    for (std::uint32_t packet = 0;; ++packet) {
        const MailboxResult result = co_await exchange(channel, slave, *mailbox, length,
                                                       foe::Opcode::ack, packet, options, progress);
        if (!result) co_return result;
        progress.bytes = static_cast<std::uint32_t>(used);
        if (last < capacity) co_return succeeded(used);
        last = std::min(capacity, from.size() - used);
        foe::write_header(body.data(), foe::Opcode::data, packet + 1);
        if (last != 0) {
            std::memcpy(body.data() + foe::header_bytes, from.data() + used, last);
        }
        used += last;
        length = foe::header_bytes + last;
    }
}

}  // namespace hal::ethercat::master
