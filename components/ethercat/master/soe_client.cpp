// SPDX-License-Identifier: MIT
#include "ethercat/master/soe_client.hpp"

#include <algorithm>
#include <charconv>
#include <cstring>

namespace hal::ethercat::master {
namespace {

// Operation and drive << 8, IDN, fragments that the last fragment announced (0: this is the first
// one).
bool accepts_soe(const Expected& expected, std::span<const std::uint8_t> payload) noexcept {
    const auto header = soe::read(payload);
    if (!header || static_cast<std::uint32_t>(header->opcode) != (expected.first & 0xff) ||
        header->drive != expected.first >> 8) {
        return false;
    }
    if (header->error) return payload.size() >= soe::header_bytes + 2;
    return header->incomplete ? expected.third == 0 || header->idn < expected.third
                              : header->idn == expected.second;
}

}  // namespace

std::optional<std::uint16_t> parse_idn(std::string_view text) noexcept {
    const auto number = [](std::string_view digits, unsigned base,
                           unsigned max) -> std::optional<unsigned> {
        unsigned value = 0;
        const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(),
                                                  value, static_cast<int>(base));
        if (error != std::errc{} || end != digits.data() + digits.size() || value > max) {
            return std::nullopt;
        }
        return value;
    };
    if (text.size() > 4 && (text[0] == 'S' || text[0] == 's' || text[0] == 'P' || text[0] == 'p') &&
        text[1] == '-' && text[3] == '-') {
        const auto set = number(text.substr(2, 1), 10, 7);

        const auto value = number(text.substr(4), 10, 0xfff);
        if (!set || !value) return std::nullopt;
        return soe::idn(text[0] == 'P' || text[0] == 'p', *set, *value);
    }
    const bool hex = text.starts_with("0x");
    if (hex) {
        text.remove_prefix(2);
    }
    const auto value = number(text, hex ? 16 : 10, 0xffff);
    if (!value) return std::nullopt;
    return static_cast<std::uint16_t>(*value);
}

std::array<char, 12> idn_text(std::uint16_t idn) noexcept {
    std::array<char, 12> text{soe::is_product(idn) ? 'P' : 'S', '-',
                              static_cast<char>('0' + soe::set_of(idn)), '-'};
    unsigned rest = soe::number_of(idn);
    for (std::size_t i = 8; i-- > 4; rest /= 10) {
        text[i] = static_cast<char>('0' + rest % 10);
    }
    return text;
}

std::span<const std::uint8_t> list_of(std::span<const std::uint8_t> value) noexcept {
    if (value.size() < 4) {
        return {};
    }
    return value.subspan(4,
                         std::min<std::size_t>(get<std::uint16_t>(value.data()), value.size() - 4));
}

Task<MailboxResult> SoeClient::read(Channel& channel, BusSlave& slave, std::uint8_t drive,
                                    std::uint16_t idn, std::uint8_t elements,
                                    std::span<std::uint8_t> to) noexcept {
    SlaveMailbox* mailbox = mailboxes_.find(slave);
    if (mailbox == nullptr) co_return refused();
    const SlaveMailbox::Hold hold = co_await mailbox->hold(channel);
    if (mailbox->body(slave).size() < soe::header_bytes) co_return refused();
    soe::write(mailbox->body(slave).data(),
               {soe::Opcode::read, false, false, drive, elements, idn});
    MailboxResult result =
        co_await mailbox->send(channel, slave, MailboxType::soe, soe::header_bytes);
    if (!result) co_return result;
    Expected expected{accepts_soe,
                      static_cast<std::uint32_t>(soe::Opcode::read_response) |
                          static_cast<std::uint32_t>(drive & 7U) << 8,
                      idn, 0};
    const std::int64_t timeout = SlaveMailbox::response_timeout_ns(slave);
    std::size_t used = 0;
    bool overflow = false;
    for (;;) {
        result = co_await mailbox->wait_for(channel, slave, MailboxType::soe, timeout, expected);
        if (!result) co_return result;
        const auto payload = mailbox->reply().payload;
        const soe::Header header = *soe::read(payload);
        if (header.error) co_return aborted(soe::error_of(payload));
        const auto data = payload.subspan(soe::header_bytes);
        overflow = overflow || used > to.size() || data.size() > to.size() - used;
        if (!overflow && !data.empty()) {
            std::memcpy(to.data() + used, data.data(), data.size());
        }
        used += data.size();
        if (!header.incomplete) break;
        expected.third = header.idn;
        if (header.idn == 0) {
            co_return refused();  // more was announced, and nothing follows
        }
    }
    if (overflow) co_return refused(0, used);
    co_return succeeded(used);
}

Task<MailboxResult> SoeClient::write(Channel& channel, BusSlave& slave, std::uint8_t drive,
                                     std::uint16_t idn, std::uint8_t element,
                                     std::span<const std::uint8_t> from) noexcept {
    SlaveMailbox* mailbox = mailboxes_.find(slave);
    if (mailbox == nullptr) co_return refused();
    const SlaveMailbox::Hold hold = co_await mailbox->hold(channel);
    const auto body = mailbox->body(slave);
    if (body.size() <= soe::header_bytes) co_return refused();
    const std::size_t capacity = body.size() - soe::header_bytes;
    std::size_t left = from.empty() ? 1 : (from.size() + capacity - 1) / capacity;
    if (left > 0xffff) co_return refused();
    for (std::size_t at = 0; left-- != 0; at += capacity) {
        const std::size_t bytes = std::min(capacity, from.size() - at);
        soe::write(body.data(), {soe::Opcode::write, left != 0, false, drive, element,
                                 left != 0 ? static_cast<std::uint16_t>(left) : idn});
        if (bytes != 0) {
            std::memcpy(body.data() + soe::header_bytes, from.data() + at, bytes);
        }
        const MailboxResult result =
            co_await mailbox->send(channel, slave, MailboxType::soe, soe::header_bytes + bytes);
        if (!result) co_return result;
    }
    const Expected expected{accepts_soe,
                            static_cast<std::uint32_t>(soe::Opcode::write_response) |
                                static_cast<std::uint32_t>(drive & 7U) << 8,
                            idn, 0};
    const std::int64_t timeout = SlaveMailbox::response_timeout_ns(slave);
    const MailboxResult result =
        co_await mailbox->wait_for(channel, slave, MailboxType::soe, timeout, expected);
    if (!result) co_return result;
    const auto payload = mailbox->reply().payload;
    if (soe::read(payload)->error) co_return aborted(soe::error_of(payload));
    co_return succeeded(from.size());
}

}  // namespace hal::ethercat::master
