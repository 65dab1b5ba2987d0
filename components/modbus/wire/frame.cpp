// SPDX-License-Identifier: MIT
#include "frame.hpp"

#include <algorithm>

namespace hal::modbus {

namespace {

constexpr std::size_t tcp_header = 7;  // transaction, protocol, length, unit

Scan scan_tcp(std::span<const std::uint8_t> bytes, Found& found) noexcept {
    if (bytes.size() < tcp_header) return Scan::incomplete;
    const std::size_t length = word_at(bytes, 4);
    if (word_at(bytes, 2) != 0 || length < 2 || length > max_pdu + 1) return Scan::corrupt;
    if (bytes.size() < 6 + length) return Scan::incomplete;
    found = {bytes[6], word_at(bytes, 0), bytes.subspan(tcp_header, length - 1), 6 + length};
    return Scan::valid;
}

std::size_t answer_length(std::uint8_t function, std::uint8_t third) noexcept {
    if ((function & exception_flag) != 0) return 5;
    switch (function) {
    case 0x01:
    case 0x02:
    case 0x03:
    case 0x04: return 5U + third;
    case 0x05:
    case 0x06:
    case 0x0f:
    case 0x10: return 8;
    default: return 0;
    }
}

std::size_t request_length(std::span<const std::uint8_t> bytes) noexcept {
    const std::uint8_t function = bytes[1];
    if (function >= 1 && function <= 6) return 8;
    if (function != 0x0f && function != 0x10) return 0;
    return bytes.size() < 7 ? 0 : 9U + bytes[6];
}

}  // namespace

std::uint16_t crc16(std::span<const std::uint8_t> bytes) noexcept {
    unsigned crc = 0xffff;
    for (const std::uint8_t byte : bytes) {
        crc ^= byte;
        for (int bit = 0; bit < 8; ++bit) {
            const bool carry = (crc & 1) != 0;
            crc >>= 1;
            if (carry) {
                crc ^= 0xa001;
            }
        }
    }
    return static_cast<std::uint16_t>(crc);
}

Frame encode(Framing framing, std::uint8_t unit, std::uint16_t transaction,
             const Pdu& pdu) noexcept {
    Frame frame;
    const auto add = [&frame](unsigned byte) {
        frame.bytes[frame.size++] = static_cast<std::uint8_t>(byte);
    };
    if (framing == Framing::tcp) {
        add(transaction >> 8U);
        add(transaction);
        add(0);
        add(0);
        add(static_cast<unsigned>(pdu.size + 1) >> 8);
        add(static_cast<unsigned>(pdu.size + 1));
    }
    add(unit);
    for (const std::uint8_t byte : pdu.span()) {
        add(byte);
    }
    if (framing == Framing::rtu) {
        const unsigned crc = crc16(frame.span());
        add(crc);
        add(crc >> 8);
    }
    return frame;
}

std::size_t rtu_length(std::span<const std::uint8_t> bytes, Role role, bool huanyang) noexcept {
    if (bytes.size() < 3) return 0;
    const std::size_t length = [&]() -> std::size_t {
        if (huanyang && (bytes[1] & exception_flag) == 0) return 5U + bytes[2];
        return role == Role::answers ? answer_length(bytes[1], bytes[2]) : request_length(bytes);
    }();
    return length <= 256 ? length : 0;
}

Scan scan(Framing framing, Role role, bool huanyang, std::span<const std::uint8_t> bytes,
          Found& found) noexcept {
    if (framing == Framing::tcp) return scan_tcp(bytes, found);
    const std::size_t length = rtu_length(bytes, role, huanyang);
    if (length == 0 || bytes.size() < length) return Scan::incomplete;
    if (crc16(bytes.first(length)) != 0) return Scan::corrupt;
    found = {bytes[0], 0, bytes.subspan(1, length - 3), length};
    return Scan::valid;
}

void ReceiveBuffer::drop(std::size_t count) noexcept {
    count = std::min(count, size_);
    std::copy(bytes_.begin() + static_cast<std::ptrdiff_t>(count),
              bytes_.begin() + static_cast<std::ptrdiff_t>(size_), bytes_.begin());
    size_ -= count;
}

}  // namespace hal::modbus
