// SPDX-License-Identifier: MIT
#include "ethercat/master/object_information.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <utility>

namespace hal::ethercat::master {
namespace {

bool accepts_information(std::uint32_t response, std::span<const std::uint8_t> payload) noexcept {
    const auto header = coe::read_information(payload);
    if (!header || coe::service_of(payload.data()) != coe::Service::sdo_information) return false;
    if (header->opcode == coe::Information::error) {
        return payload.size() >= coe::information_header_bytes + 4;
    }
    return static_cast<std::uint32_t>(header->opcode) == response;
}
bool is_information_error(std::span<const std::uint8_t> payload) noexcept {
    return static_cast<coe::Information>(payload[2] & 0x7f) == coe::Information::error;
}

// Operation; list, or index and sub-index; bytes of these.
bool accepts_first_fragment(const Expected& expected,
                            std::span<const std::uint8_t> payload) noexcept {
    if (!accepts_information(expected.first, payload) ||
        payload.size() < coe::information_header_bytes) {
        return false;
    }
    if (is_information_error(payload)) return true;
    return payload.size() >= coe::information_header_bytes + expected.third &&
           std::memcmp(payload.data() + coe::information_header_bytes, &expected.second,
                       std::min(expected.third, 3U)) == 0;
}
// Operation; fragments that the last one announced.
bool accepts_next_fragment(const Expected& expected,
                           std::span<const std::uint8_t> payload) noexcept {
    if (!accepts_information(expected.first, payload)) return false;
    return is_information_error(payload) ||
           coe::read_information(payload)->fragments_left + 1U == expected.second;
}

/// The bytes of a response that consists of fragments: those of the description to `head`, all
/// others to `rest`.
class FragmentBuffer {
public:
    FragmentBuffer(std::span<std::uint8_t> head, std::span<std::uint8_t> rest)
        : head_(head), rest_(rest) {}

    /// Appends the data of a fragment. Returns false if the first one is shorter than the head.
    /// What does not fit is dropped, so that the mailbox is read to the end.
    bool append(std::span<const std::uint8_t> data) noexcept {
        if (!has_head_) {
            if (data.size() < head_.size()) return false;
            std::copy_n(data.begin(), head_.size(), head_.begin());
            data = data.subspan(head_.size());
            has_head_ = true;
        }
        const std::size_t fitting = std::min(data.size(), rest_.size() - used_);
        overflowed_ = overflowed_ || fitting < data.size();
        std::copy_n(data.begin(), fitting, rest_.begin() + static_cast<std::ptrdiff_t>(used_));
        used_ += fitting;
        return true;
    }
    /// Returns the number of bytes in `rest`.
    std::size_t used() const noexcept { return used_; }
    bool overflowed() const noexcept { return overflowed_; }

private:
    std::span<std::uint8_t> head_;
    std::span<std::uint8_t> rest_;
    std::size_t used_ = 0;
    bool has_head_ = false;
    bool overflowed_ = false;
};

}  // namespace

// `key` is what the request asks for, as `key_bytes` bytes: a list, or an index and a sub-index.
// The first fragment repeats it.
Task<MailboxResult> ObjectInformation::fetch(Channel& channel, BusSlave& slave,
                                             coe::Information request, std::uint32_t key,
                                             std::size_t key_bytes, std::span<std::uint8_t> head,
                                             std::span<std::uint8_t> rest) noexcept {
    SlaveMailbox* mailbox = mailboxes_.find(slave);
    if (mailbox == nullptr) co_return refused();
    SlaveMailbox::Hold hold = co_await mailbox->hold(channel);
    const auto body = mailbox->body(slave);
    if (body.size() < coe::sdo_bytes) co_return refused();
    coe::write_information(body.data(), {request, false, 0});
    std::memcpy(body.data() + coe::information_header_bytes, &key, key_bytes);
    MailboxResult result = co_await mailbox->send(channel, slave, MailboxType::coe,
                                                  coe::information_header_bytes + key_bytes);
    if (!result) co_return result;

    // Each fragment announces how many follow, which distinguishes a duplicate from the next one.
    const std::uint32_t response = static_cast<std::uint32_t>(request) + 1;
    const std::int64_t timeout = SlaveMailbox::response_timeout_ns(slave);
    FragmentBuffer buffer(head, rest);
    Expected expected{accepts_first_fragment, response, key, static_cast<std::uint32_t>(key_bytes)};
    for (;;) {
        result = co_await mailbox->wait_for(channel, slave, MailboxType::coe, timeout, expected);
        if (!result) co_return result;
        const auto payload = mailbox->reply().payload;
        const auto header = *coe::read_information(payload);
        const auto data = payload.subspan(coe::information_header_bytes);
        if (header.opcode == coe::Information::error) {
            co_return aborted(get<std::uint32_t>(data.data()));
        }
        if (!buffer.append(data)) co_return refused();
        if (!header.incomplete) break;
        const bool is_none_left = header.fragments_left == 0;
        if (is_none_left) co_return refused();  // contradicts `incomplete`: nothing would follow
        expected = {accepts_next_fragment, response, header.fragments_left};
    }
    if (buffer.overflowed()) co_return refused(0, buffer.used());
    co_return succeeded(buffer.used());
}

Task<MailboxResult> ObjectInformation::list(Channel& channel, BusSlave& slave, coe::List which,
                                            std::span<std::uint8_t> to) noexcept {
    std::array<std::uint8_t, 2> head{};  // the type; following fragments have none
    const MailboxResult result = co_await fetch(channel, slave, coe::Information::list_request,
                                                static_cast<std::uint16_t>(which), 2, head, to);
    co_return result;
}

Task<MailboxResult> ObjectInformation::object(Channel& channel, BusSlave& slave,
                                              std::uint16_t index, ObjectDescription& description,
                                              std::span<char> name) noexcept {
    std::array<std::uint8_t, 6> head{};
    const std::span<std::uint8_t> to{reinterpret_cast<std::uint8_t*>(name.data()), name.size()};
    const MailboxResult result =
        co_await fetch(channel, slave, coe::Information::object_request, index, 2, head, to);
    if (result) {
        description.type = get<std::uint16_t>(head.data() + 2);
        description.max_sub = head[4];
        description.code = static_cast<coe::ObjectCode>(head[5]);

        description.name_length = result.length;
    }
    co_return result;
}

Task<MailboxResult> ObjectInformation::entry(Channel& channel, BusSlave& slave, std::uint16_t index,
                                             std::uint8_t sub, EntryDescription& description,
                                             std::span<char> name) noexcept {
    std::array<std::uint8_t, 10> head{};
    const std::span<std::uint8_t> to{reinterpret_cast<std::uint8_t*>(name.data()), name.size()};
    // value information 0: only the name
    const std::uint32_t what = index | static_cast<std::uint32_t>(sub) << 16;
    const MailboxResult result =
        co_await fetch(channel, slave, coe::Information::entry_request, what, 4, head, to);
    if (result) {
        description.type = get<std::uint16_t>(head.data() + 4);

        description.bits = get<std::uint16_t>(head.data() + 6);
        description.access = get<std::uint16_t>(head.data() + 8);

        description.name_length = result.length;
    }
    co_return result;
}

}  // namespace hal::ethercat::master
