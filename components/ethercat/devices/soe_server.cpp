// SPDX-License-Identifier: MIT
#include "ethercat/devices/soe_server.hpp"

#include <algorithm>
#include <cstring>
#include <utility>

namespace hal::ethercat::devices {

namespace {

/// Returns the communication phase of SoE in a state: 2 to 4 of Sercos, from 0.
unsigned phase_of(State state) noexcept {
    switch (state) {
    case State::op: return 2;
    case State::safeop: return 1;
    default: return 0;
    }
}

}  // namespace

Idn* SoeServer::find(std::uint8_t drive, std::uint16_t number) noexcept {
    for (auto& i : idns_) {
        if (i.drive == drive && i.number == number) return &i;
    }
    return nullptr;
}

bool SoeServer::has_drive(std::uint8_t drive) const noexcept {
    if (drive == 0) return true;
    return std::any_of(idns_.begin(), idns_.end(),
                       [drive](const Idn& i) { return i.drive == drive; });
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
    if (!has_drive(h->drive)) return refuse(*h, soe::error::no_drive, out);
    if (h->opcode == soe::Opcode::read) return read(*h, out);
    if (h->opcode == soe::Opcode::write) {
        return write(*h, message.payload.subspan(soe::header_bytes), state, out);
    }
    out.send(MailboxType::error,
             write_mailbox_error(out.payload(), MailboxError::service_not_supported));
}

void SoeServer::read(const soe::Header& h, Outbox& out) noexcept {
    const Idn* idn = find(h.drive, h.idn);
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
    const auto list = [&](const void* from, std::size_t length, std::size_t max) {
        const std::uint16_t lengths[2] = {static_cast<std::uint16_t>(length),
                                          static_cast<std::uint16_t>(max)};
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
    Idn* idn = find(h.drive, h.idn);
    if (idn == nullptr) return refuse(h, soe::error::no_idn, out);
    if (h.elements != soe::element::value) {
        return refuse(h, h.elements == 0 ? soe::error::no_element : soe::error::name_read_only,
                      out);
    }
    if (idn->attribute.write_protected(0) && idn->attribute.write_protected(2)) {
        return refuse(h, soe::error::read_only, out);
    }
    if (idn->attribute.write_protected(phase_of(state)))
        return refuse(h, soe::error::protected_now, out);
    const std::size_t head = idn->attribute.list() ? 4 : 0;
    const std::size_t max =
        idn->attribute.list() ? head + idn->value.size() : idn->attribute.bytes();
    const std::size_t min = idn->attribute.list() ? head : idn->attribute.bytes();
    if (length > max) return refuse(h, soe::error::too_long, out);
    if (length < min || (head != 0 && get<std::uint16_t>(buffer_.data()) > length - head)) {
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

}  // namespace hal::ethercat::devices
