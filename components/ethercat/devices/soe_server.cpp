// SPDX-License-Identifier: MIT
#include "ethercat/devices/soe_server.hpp"

#include <algorithm>
#include <cstring>
#include <optional>
#include <span>
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

/// An error code of SoE; nullopt: none.
using SoeError = std::optional<std::uint16_t>;

// A list is sent with the lengths of its value and of its capacity before the elements.
constexpr std::size_t list_header_bytes = 4;

/// Checks that the master may write the elements of a request, in this state.
SoeError access_error(const soe::Header& h, const Idn& idn, State state) noexcept {
    if (h.elements == 0) return soe::error::no_element;
    if (h.elements != soe::element::value) return soe::error::name_read_only;
    const soe::Attribute attribute = idn.attribute;
    const bool is_read_only = attribute.write_protected(0) && attribute.write_protected(2);
    if (is_read_only) return soe::error::read_only;
    if (attribute.write_protected(phase_of(state))) return soe::error::protected_now;
    return std::nullopt;
}

/// Checks that the bytes are a list of at most the capacity, or a value of the exact size.
SoeError length_error(const Idn& idn, std::span<const std::uint8_t> written) noexcept {
    if (!idn.attribute.list()) {
        if (written.size() > idn.attribute.bytes()) return soe::error::too_long;
        if (written.size() < idn.attribute.bytes()) return soe::error::too_short;
        return std::nullopt;
    }
    if (written.size() > list_header_bytes + idn.value.size()) return soe::error::too_long;
    if (written.size() < list_header_bytes) return soe::error::too_short;
    const std::size_t announced = get<std::uint16_t>(written.data());
    if (announced > written.size() - list_header_bytes) return soe::error::too_short;
    return std::nullopt;
}

/// Returns the value in bytes that length_error() accepts: for a list, its elements.
std::span<const std::uint8_t> value_of(const Idn& idn,
                                       std::span<const std::uint8_t> written) noexcept {
    if (!idn.attribute.list()) return written;
    return written.subspan(list_header_bytes, get<std::uint16_t>(written.data()));
}

/// Checks a value against the limits of its IDN.
SoeError limit_error(const Idn& idn, std::span<const std::uint8_t> value) noexcept {
    const bool has_limits = idn.low != idn.high;
    if (!has_limits) return std::nullopt;
    std::int64_t number = 0;
    std::memcpy(&number, value.data(), std::min<std::size_t>(value.size(), sizeof number));
    if (idn.attribute.is_signed() && value.size() == 4) {
        number = static_cast<std::int32_t>(number);
    }
    if (number < idn.low) return soe::error::below_minimum;
    if (number > idn.high) return soe::error::above_maximum;
    return std::nullopt;
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
    std::copy(data.begin(), data.end(), buffer_.data() + written_);
    written_ += data.size();
    if (h.incomplete) return;
    const std::span<const std::uint8_t> written(buffer_.data(), std::exchange(written_, 0));
    Idn* const idn = find(h.drive, h.idn);
    if (idn == nullptr) return refuse(h, soe::error::no_idn, out);
    if (const auto error = access_error(h, *idn, state)) return refuse(h, *error, out);
    if (const auto error = length_error(*idn, written)) return refuse(h, *error, out);
    const std::span<const std::uint8_t> value = value_of(*idn, written);
    if (const auto error = limit_error(*idn, value)) return refuse(h, *error, out);
    std::copy(value.begin(), value.end(), idn->value.begin());
    idn->length = value.size();
    soe::Header answer = h;
    answer.opcode = soe::Opcode::write_response;
    soe::write(out.payload(), answer);
    out.send(MailboxType::soe, soe::header_bytes);
}

}  // namespace hal::ethercat::devices
