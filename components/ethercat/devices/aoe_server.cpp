// SPDX-License-Identifier: MIT
#include "ethercat/devices/aoe_server.hpp"

#include <algorithm>
#include <cstring>

namespace hal::ethercat::devices {

void AoeServer::take(const MailboxMessage& message, State state, Outbox& out) noexcept {
    const auto h = aoe::read(message.payload);
    if (!h) {
        return out.send(MailboxType::error,
                        write_mailbox_error(out.payload(), MailboxError::too_short));
    }
    if (h->response()) return;
    const auto data = message.payload.subspan(aoe::header_bytes, h->length);
    std::uint8_t* to = out.payload() + aoe::header_bytes;
    const auto respond = [&](std::size_t length, std::uint32_t error = 0) {
        aoe::write(out.payload(), aoe::response_to(*h, static_cast<std::uint32_t>(length), error));
        out.send(MailboxType::aoe, aoe::header_bytes + length);
    };
    const auto sdo = [&](auto&& work) {
        if (data.size() < aoe::address_bytes) return respond(0, aoe::error::size);
        if (get<std::uint32_t>(data.data()) != aoe::group_sdo) {
            put(to, aoe::error::group);
            return respond(4);
        }
        const auto offset = get<std::uint32_t>(data.data() + 4);
        work(static_cast<std::uint16_t>(offset >> 16), static_cast<std::uint8_t>(offset),
             (offset & 0x100) != 0, get<std::uint32_t>(data.data() + 8));
    };
    switch (h->command) {
    case aoe::Command::read:
        return sdo([&](std::uint16_t index, std::uint8_t sub, bool complete, std::uint32_t max) {
            std::size_t n = 0;
            const std::size_t space =
                out.mailbox() - mailbox_header_bytes - aoe::header_bytes - aoe::read_response_bytes;
            const std::span<std::uint8_t> space_for(to + aoe::read_response_bytes,
                                                    std::min<std::size_t>(space, max));
            const auto code = dictionary_->read(index, sub, complete, state, space_for, n);
            put(to, cia301::code_of(code));
            put(to + 4, static_cast<std::uint32_t>(n));
            respond(aoe::read_response_bytes + n);
        });
    case aoe::Command::write:
        return sdo([&](std::uint16_t index, std::uint8_t sub, bool complete, std::uint32_t length) {
            if (length > data.size() - aoe::address_bytes) return respond(0, aoe::error::size);
            const auto code = dictionary_->write(index, sub, complete, state,
                                                 data.subspan(aoe::address_bytes, length));
            put(to, cia301::code_of(code));
            respond(aoe::write_response_bytes);
        });
    case aoe::Command::read_state:
        put<std::uint32_t>(to, 0);
        put<std::uint16_t>(to + 4, 5);
        put(to + 6, static_cast<std::uint16_t>(state));
        return respond(8);
    case aoe::Command::device_info:
        std::memset(to, 0, 24);
        to[4] = 1;
        std::memcpy(to + 8, "mailbox_device", 14);
        return respond(24);
    default: return respond(0, aoe::error::unknown_command);
    }
}

}  // namespace hal::ethercat::devices
