// SPDX-License-Identifier: MIT
#include "ethercat/master/coe_client.hpp"

#include <algorithm>
#include <cstring>
#include <optional>

namespace hal::ethercat::master {
namespace {

/// Returns whether the payload aborts a transfer of an object. Some slaves send an abort as a
/// request.
bool is_sdo_abort(std::span<const std::uint8_t> payload, std::uint32_t index,
                  std::uint32_t sub) noexcept {
    const auto sdo = coe::read_sdo(payload);
    if (!sdo || sdo->command != coe::command::abort || sdo->index != index || sdo->sub != sub) {
        return false;
    }
    const auto service = coe::service_of(payload.data());
    return service == coe::Service::sdo_response || service == coe::Service::sdo_request;
}

// Index, sub-index, specifier.
bool accepts_sdo(const Expected& expected, std::span<const std::uint8_t> payload) noexcept {
    if (is_sdo_abort(payload, expected.first, expected.second)) return true;
    const auto sdo = coe::read_sdo(payload);
    return sdo && coe::service_of(payload.data()) == coe::Service::sdo_response &&
           sdo->is(static_cast<std::uint8_t>(expected.third)) && sdo->index == expected.first &&
           sdo->sub == expected.second;
}

// Index, sub-index, specifier with toggle bit.
bool accepts_segment(const Expected& expected, std::span<const std::uint8_t> payload) noexcept {
    if (is_sdo_abort(payload, expected.first, expected.second)) return true;
    return payload.size() >= coe::segment_data &&
           coe::service_of(payload.data()) == coe::Service::sdo_response &&
           (payload[2] & (coe::command::specifier | coe::command::toggle)) == expected.third;
}

/// Returns the reply that a segment of an object waits for.
Expected segment_reply(std::uint16_t index, std::uint8_t sub, std::uint8_t command,
                       std::uint8_t toggle) noexcept {
    return {accepts_segment, index, sub, static_cast<std::uint32_t>(command | toggle)};
}

/// Returns the abort code in an accepted reply; nullopt for another reply.
std::optional<std::uint32_t> abort_in(std::span<const std::uint8_t> payload) noexcept {
    if (payload[2] != coe::command::abort) return std::nullopt;
    return coe::read_sdo(payload)->value;
}

}  // namespace

bool EmergencyQueue::take(const BusSlave& slave, const MailboxMessage& message) noexcept {
    if (message.payload.size() < coe::header_bytes ||
        coe::service_of(message.payload.data()) != coe::Service::emergency) {
        return false;
    }
    if (const auto emergency = coe::read_emergency(message.payload)) {
        if (!queue_.push({slave.number, *emergency})) {
            ++lost_;
        }
    }
    return true;
}

Task<SdoResult> CoeClient::write_other(Channel& channel, BusSlave& slave,
                                       const StartupWrite& write) noexcept {
    if (write.protocol == StartupWrite::Protocol::aoe) {
        AoeAddress address;
        address.target_port = write.port;
        const SdoResult result = co_await aoe_.write(
            channel, slave, address, aoe::group_sdo,
            aoe::sdo_offset(write.index, write.sub, write.complete), write.data);
        co_return result;
    }
    const SdoResult result = co_await soe_.write(channel, slave, write.sub, write.index,
                                                 soe::element::value, write.data);
    co_return result;
}

void CoeClient::reset_mailbox(const BusSlave& slave) noexcept {
    if (SlaveMailbox* const mailbox = mailboxes_.find(slave)) {
        mailbox->reset();
    }
}

Task<SdoResult> CoeClient::upload(Channel& channel, BusSlave& slave, std::uint16_t index,
                                  std::uint8_t sub, bool complete,
                                  std::span<std::uint8_t> to) noexcept {
    SlaveMailbox* mailbox = mailboxes_.find(slave);
    if (mailbox == nullptr) co_return refused();
    SlaveMailbox::Hold hold = co_await mailbox->hold(channel);
    coe::Sdo request;
    request.command =
        static_cast<std::uint8_t>(coe::command::upload | (complete ? coe::command::complete : 0));
    request.index = index;
    request.sub = sub;
    if (mailbox->body(slave).size() < coe::sdo_bytes) co_return refused();
    const std::size_t length =
        coe::write_sdo(mailbox->body(slave).data(), coe::Service::sdo_request, request);
    SdoResult result =
        co_await mailbox->exchange(channel, slave, MailboxType::coe, length,
                                   {accepts_sdo, index, sub, coe::command::upload_response});
    if (!result) co_return result;

    const auto payload = mailbox->reply().payload;
    if (const auto code = abort_in(payload)) co_return aborted(*code);
    const coe::Sdo sdo = *coe::read_sdo(payload);
    if (sdo.expedited()) {
        const std::size_t bytes = sdo.expedited_bytes();
        if (bytes > to.size()) co_return refused(0, bytes);
        std::memcpy(to.data(), payload.data() + coe::sdo_data, bytes);
        co_return succeeded(bytes);
    }
    const std::size_t size = sdo.value;
    const std::size_t first = std::min(size, payload.size() - coe::sdo_bytes);
    if (size > to.size()) {
        if (first < size) {
            co_await send_abort(channel, slave, *mailbox, index, sub, code_of(coe::Abort::memory));
        }
        co_return refused(0, size);
    }
    if (first != 0) {
        std::memcpy(to.data(), payload.data() + coe::sdo_bytes, first);
    }
    if (first == size) co_return succeeded(size);
    result = co_await upload_segments(channel, slave, *mailbox, index, sub, size, first, to);
    co_return result;
}

Task<SdoResult> CoeClient::download(Channel& channel, BusSlave& slave, std::uint16_t index,
                                    std::uint8_t sub, bool complete,
                                    std::span<const std::uint8_t> from) noexcept {
    SlaveMailbox* mailbox = mailboxes_.find(slave);
    if (mailbox == nullptr) co_return refused();
    SlaveMailbox::Hold hold = co_await mailbox->hold(channel);
    const auto body = mailbox->body(slave);
    if (body.size() < coe::sdo_bytes) co_return refused();
    coe::Sdo request;
    request.index = index;
    request.sub = sub;
    std::size_t first = 0;
    std::size_t length = coe::sdo_bytes;
    if (!complete && !from.empty() && from.size() <= 4) {
        request.command = coe::expedited_command(coe::command::download, from.size());
        std::memcpy(&request.value, from.data(), from.size());
        first = from.size();
    } else {
        request.command =
            static_cast<std::uint8_t>(coe::command::download | coe::command::size_given |
                                      (complete ? coe::command::complete : 0));
        request.value = static_cast<std::uint32_t>(from.size());
        first = std::min(from.size(), body.size() - coe::sdo_bytes);
        if (first != 0) {
            std::memcpy(body.data() + coe::sdo_bytes, from.data(), first);
        }
        length += first;
    }
    coe::write_sdo(body.data(), coe::Service::sdo_request, request);
    SdoResult result =
        co_await mailbox->exchange(channel, slave, MailboxType::coe, length,
                                   {accepts_sdo, index, sub, coe::command::download_response});
    if (!result) co_return result;
    if (const auto code = abort_in(mailbox->reply().payload)) co_return aborted(*code);
    if (first < from.size()) {
        result =
            co_await download_segments(channel, slave, *mailbox, index, sub, from.subspan(first));
        if (!result) co_return result;
    }
    co_return succeeded(from.size());
}

// Segments. A segment names no object: a reply with the toggle bit of the previous one is a
// duplicate and is dropped.

Task<SdoResult> CoeClient::upload_segments(Channel& channel, BusSlave& slave, SlaveMailbox& mailbox,
                                           std::uint16_t index, std::uint8_t sub, std::size_t size,
                                           std::size_t first, std::span<std::uint8_t> to) noexcept {
    std::size_t used = first;
    for (std::uint8_t toggle = 0;; toggle ^= coe::command::toggle) {
        coe::Sdo request;
        request.command = static_cast<std::uint8_t>(coe::command::upload_segment | toggle);
        const std::size_t length =
            coe::write_sdo(mailbox.body(slave).data(), coe::Service::sdo_request, request);
        const SdoResult result = co_await mailbox.exchange(
            channel, slave, MailboxType::coe, length,
            segment_reply(index, sub, coe::command::upload_segment_response, toggle));
        if (!result) co_return result;
        const auto payload = mailbox.reply().payload;
        if (const auto code = abort_in(payload)) co_return aborted(*code);
        const bool last = (payload[2] & coe::command::last_segment) != 0;
        const auto data = coe::segment_of(payload);
        // more or less than announced
        if (data.size() > size - used || (last && used + data.size() != size)) {
            const bool more = data.size() > size - used;
            if (!last) {
                co_await send_abort(channel, slave, mailbox, index, sub,
                                    code_of(coe::Abort::length));
            }
            co_return aborted(more ? code_of(coe::Abort::too_long)
                                   : code_of(coe::Abort::too_short));
        }
        if (!data.empty()) {
            std::memcpy(to.data() + used, data.data(), data.size());
        }
        used += data.size();
        if (last) co_return succeeded(used);
        if (data.empty()) {  // would never end
            co_await send_abort(channel, slave, mailbox, index, sub, code_of(coe::Abort::length));
            co_return aborted(code_of(coe::Abort::length));
        }
    }
}

Task<SdoResult> CoeClient::download_segments(Channel& channel, BusSlave& slave,
                                             SlaveMailbox& mailbox, std::uint16_t index,
                                             std::uint8_t sub,
                                             std::span<const std::uint8_t> rest) noexcept {
    const std::size_t capacity = mailbox.body(slave).size() - coe::segment_data;
    for (std::uint8_t toggle = 0; !rest.empty(); toggle ^= coe::command::toggle) {
        const auto data = rest.first(std::min(rest.size(), capacity));
        rest = rest.subspan(data.size());
        const std::size_t length =
            coe::write_segment(mailbox.body(slave).data(), coe::Service::sdo_request,
                               coe::command::download_segment, toggle != 0, rest.empty(), data);
        const SdoResult result = co_await mailbox.exchange(
            channel, slave, MailboxType::coe, length,
            segment_reply(index, sub, coe::command::download_segment_response, toggle));
        if (!result) co_return result;
        if (const auto code = abort_in(mailbox.reply().payload)) co_return aborted(*code);
    }
    co_return succeeded();
}

Task<> CoeClient::send_abort(Channel& channel, BusSlave& slave, SlaveMailbox& mailbox,
                             std::uint16_t index, std::uint8_t sub, std::uint32_t code) noexcept {
    coe::Sdo request;
    request.command = coe::command::abort;
    request.index = index;
    request.sub = sub;

    request.value = code;
    const std::size_t length =
        coe::write_sdo(mailbox.body(slave).data(), coe::Service::sdo_request, request);
    co_await mailbox.send(channel, slave, MailboxType::coe, length);  // has no reply
}

}  // namespace hal::ethercat::master
