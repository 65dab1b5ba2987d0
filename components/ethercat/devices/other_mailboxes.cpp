// SPDX-License-Identifier: MIT
// SoE, AoE and VoE of the device with every protocol.
#include <algorithm>
#include <cstring>
#include <utility>

#include "ethercat/devices/mailbox_device.hpp"

namespace hal::ethercat::devices {

Idn* SoeServer::find(std::uint16_t number) noexcept {
    for (auto& i : idns_) {
        if (i.number == number) return &i;
    }
    return nullptr;
}

void SoeServer::refuse(const soe::Header& h, std::uint16_t code, Outbox& out) noexcept {
    soe::Header answer = h;
    answer.opcode =
        h.opcode == soe::Opcode::read ? soe::Opcode::read_response : soe::Opcode::write_response;
    answer.error = true;
    answer.incomplete = false;
    soe::write(out.payload(), answer);
    put(out.payload() + soe::header_bytes, code);
    out.send(MailboxType::soe, soe::header_bytes + 2);
}

void SoeServer::take(const MailboxMessage& message, State state, Outbox& out) noexcept {
    const auto h = soe::read(message.payload);
    if (!h) {
        return out.send(MailboxType::error,
                        write_mailbox_error(out.payload(), MailboxError::too_short));
    }
    if (h->drive != 0) return refuse(*h, soe::error::no_drive, out);
    if (h->opcode == soe::Opcode::read) return read(*h, out);
    if (h->opcode == soe::Opcode::write) {
        return write(*h, message.payload.subspan(soe::header_bytes), state, out);
    }
    out.send(MailboxType::error,
             write_mailbox_error(out.payload(), MailboxError::service_not_supported));
}

void SoeServer::read(const soe::Header& h, Outbox& out) noexcept {
    const Idn* idn = find(h.idn);
    if (idn == nullptr) return refuse(h, soe::error::no_idn, out);
    if (h.elements == 0) return refuse(h, soe::error::no_element, out);
    if ((h.elements & soe::element::unit) != 0 && idn->unit.empty()) {
        return refuse(h, soe::error::no_unit, out);
    }
    if ((h.elements & soe::element::minimum) != 0 && idn->low == idn->high) {
        return refuse(h, soe::error::no_minimum, out);
    }
    if ((h.elements & soe::element::maximum) != 0 && idn->low == idn->high) {
        return refuse(h, soe::error::no_maximum, out);
    }
    std::size_t n = 0;
    const auto bytes = [&](const void* from, std::size_t length) {
        std::memcpy(buffer_.data() + n, from, length);
        n += length;
    };
    const auto list = [&](const void* from, std::size_t length, std::size_t most) {
        const std::uint16_t lengths[2] = {static_cast<std::uint16_t>(length),
                                          static_cast<std::uint16_t>(most)};
        bytes(lengths, 4);
        bytes(from, length);
    };
    const std::size_t width = idn->attribute.bytes();
    if ((h.elements & soe::element::state) != 0) {
        bytes("\0\0", 2);
    }
    if ((h.elements & soe::element::name) != 0) {
        list(idn->name.data(), idn->name.size(), idn->name.size());
    }
    if ((h.elements & soe::element::attribute) != 0) {
        bytes(&idn->attribute.raw, 4);
    }
    if ((h.elements & soe::element::unit) != 0) {
        list(idn->unit.data(), idn->unit.size(), idn->unit.size());
    }
    if ((h.elements & soe::element::minimum) != 0) {
        bytes(&idn->low, width);
    }
    if ((h.elements & soe::element::maximum) != 0) {
        bytes(&idn->high, width);
    }
    if ((h.elements & soe::element::value) != 0) {
        if (idn->attribute.list()) {
            list(idn->value.data(), idn->length, idn->value.size());
        } else {
            bytes(idn->value.data(), width);
        }
    }
    left_ = n;
    at_ = 0;
    answer_ = h;
    answer_.opcode = soe::Opcode::read_response;
    pump(out);
}

void SoeServer::pump(Outbox& out) noexcept {
    if (left_ == 0) return;
    const std::size_t capacity = soe::capacity(out.mailbox());
    const std::size_t n = std::min(left_, capacity);
    soe::Header h = answer_;
    h.incomplete = left_ > n;
    if (h.incomplete) {
        h.idn = static_cast<std::uint16_t>((left_ + capacity - 1) / capacity - 1);
    }
    soe::write(out.payload(), h);
    std::memcpy(out.payload() + soe::header_bytes, buffer_.data() + at_, n);
    out.send(MailboxType::soe, soe::header_bytes + n);
    left_ -= n;
    at_ += n;
}

void SoeServer::write(const soe::Header& h, std::span<const std::uint8_t> data, State state,
                      Outbox& out) noexcept {
    left_ = 0;
    if (data.size() > buffer_.size() - written_) {
        written_ = 0;
        return refuse(h, soe::error::too_long, out);
    }
    if (!data.empty()) {
        std::memcpy(buffer_.data() + written_, data.data(), data.size());
    }
    written_ += data.size();
    if (h.incomplete) return;
    const std::size_t length = std::exchange(written_, 0);
    Idn* idn = find(h.idn);
    if (idn == nullptr) return refuse(h, soe::error::no_idn, out);
    if (h.elements != soe::element::value) {
        return refuse(h, h.elements == 0 ? soe::error::no_element : soe::error::name_read_only,
                      out);
    }
    const unsigned phase = state == State::op ? 2 : state == State::safeop ? 1 : 0;
    if (idn->attribute.write_protected(0) && idn->attribute.write_protected(2)) {
        return refuse(h, soe::error::read_only, out);
    }
    if (idn->attribute.write_protected(phase)) return refuse(h, soe::error::protected_now, out);
    const std::size_t head = idn->attribute.list() ? 4 : 0;
    const std::size_t most =
        idn->attribute.list() ? head + idn->value.size() : idn->attribute.bytes();
    const std::size_t least = idn->attribute.list() ? head : idn->attribute.bytes();
    if (length > most) return refuse(h, soe::error::too_long, out);
    if (length < least || (head != 0 && get<std::uint16_t>(buffer_.data()) > length - head)) {
        return refuse(h, soe::error::too_short, out);
    }
    const std::size_t bytes = head != 0 ? get<std::uint16_t>(buffer_.data()) : length;
    if (idn->low != idn->high) {
        std::int64_t value = 0;
        std::memcpy(&value, buffer_.data(), std::min<std::size_t>(bytes, 8));
        if (idn->attribute.type() == 2 && bytes == 4) {
            value = static_cast<std::int32_t>(value);
        }
        if (value < idn->low) return refuse(h, soe::error::below_minimum, out);
        if (value > idn->high) return refuse(h, soe::error::above_maximum, out);
    }
    std::memcpy(idn->value.data(), buffer_.data() + head, bytes);
    idn->length = bytes;
    soe::Header answer = h;
    answer.opcode = soe::Opcode::write_response;
    soe::write(out.payload(), answer);
    out.send(MailboxType::soe, soe::header_bytes);
}

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
        return sdo([&](std::uint16_t index, std::uint8_t sub, bool complete, std::uint32_t most) {
            std::size_t n = 0;
            const std::size_t space =
                out.mailbox() - mailbox_header_bytes - aoe::header_bytes - aoe::read_response_bytes;
            const std::span<std::uint8_t> space_for(to + aoe::read_response_bytes,
                                                    std::min<std::size_t>(space, most));
            const auto code = dictionary_->read(index, sub, complete, state, space_for, n);
            put(to, code);
            put(to + 4, static_cast<std::uint32_t>(n));
            respond(aoe::read_response_bytes + n);
        });
    case aoe::Command::write:
        return sdo([&](std::uint16_t index, std::uint8_t sub, bool complete, std::uint32_t length) {
            if (length > data.size() - aoe::address_bytes) return respond(0, aoe::error::size);
            put(to, dictionary_->write(index, sub, complete, state,
                                       data.subspan(aoe::address_bytes, length)));
            respond(aoe::write_response_bytes);
        });
    case aoe::Command::read_state:
        put<std::uint32_t>(to, 0), put<std::uint16_t>(to + 4, 5),
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

void VoeEcho::take(const MailboxMessage& message, State, Outbox& out) noexcept {
    const std::size_t n = std::min(message.payload.size(), out.mailbox() - mailbox_header_bytes);
    if (n != 0) {
        std::memcpy(out.payload(), message.payload.data(), n);
    }
    out.send(MailboxType::voe, n);
}

}  // namespace hal::ethercat::devices
