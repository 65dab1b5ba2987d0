// SPDX-License-Identifier: MIT
// Segmented SDO transfers. A segment names no object: a reply with the toggle bit of the previous
// one is a duplicate and is dropped.
#include <algorithm>
#include <cstring>

#include "ethercat/master/coe_client.hpp"

namespace hal::ethercat::master {
namespace {

// Index, sub-index, specifier with toggle bit.
bool accepts_segment(const Expected& expected, std::span<const std::uint8_t> payload) noexcept {
    if (is_sdo_abort(payload, expected.first, expected.second)) return true;
    return payload.size() >= coe::segment_data &&
           coe::service_of(payload.data()) == coe::Service::sdo_response &&
           (payload[2] & (coe::command::specifier | coe::command::toggle)) == expected.third;
}

}  // namespace

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
            {accepts_segment, index, sub,
             static_cast<std::uint32_t>(coe::command::upload_segment_response | toggle)});
        if (!result) co_return result;
        const auto payload = mailbox.reply().payload;
        if (payload[2] == coe::command::abort) co_return aborted(coe::read_sdo(payload)->value);
        const bool last = (payload[2] & coe::command::last_segment) != 0;
        const auto data = coe::segment_of(payload);
        // more or less than announced
        if (data.size() > size - used || (last && used + data.size() != size)) {
            const bool more = data.size() > size - used;
            if (!last) {
                co_await send_abort(channel, slave, mailbox, index, sub, coe::abort::length);
            }
            co_return aborted(more ? coe::abort::too_long : coe::abort::too_short);
        }
        if (!data.empty()) {
            std::memcpy(to.data() + used, data.data(), data.size());
        }
        used += data.size();
        if (last) co_return succeeded(used);
        if (data.empty()) {  // would never end
            co_await send_abort(channel, slave, mailbox, index, sub, coe::abort::length);
            co_return aborted(coe::abort::length);
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
            {accepts_segment, index, sub,
             static_cast<std::uint32_t>(coe::command::download_segment_response | toggle)});
        if (!result) co_return result;
        const auto payload = mailbox.reply().payload;
        if (payload[2] == coe::command::abort) co_return aborted(coe::read_sdo(payload)->value);
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
