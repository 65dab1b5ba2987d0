// SPDX-License-Identifier: MIT
#include "pdu.hpp"

#include <algorithm>
#include <cstdio>
#include <iterator>

namespace hal::modbus {

namespace {

bool reads_bits(std::uint8_t function) {
    return function == static_cast<std::uint8_t>(Function::read_coils) ||
           function == static_cast<std::uint8_t>(Function::read_discrete);
}
bool reads(std::uint8_t function) { return function >= 1 && function <= 4; }

/// The answer to a read: function, number of bytes, bytes (clauses 6.1 to 6.4).
Answer decode_read(const Pdu& request, std::span<const std::uint8_t> answer) noexcept {
    const std::uint16_t count = word_at(request.span(), 3);
    const std::size_t expected =
        reads_bits(request.function()) ? (count + 7U) / 8 : std::size_t{count} * 2;
    if (answer.size() != expected + 2 || answer[1] != expected) return {};
    return {Verdict::good, 0, answer.subspan(2)};
}

}  // namespace

Pdu read_request(Function function, std::uint16_t address, std::uint16_t count) noexcept {
    Pdu pdu;
    pdu.add8(static_cast<unsigned>(function));
    pdu.add16(address);
    pdu.add16(count);
    return pdu;
}

Pdu write_coil_request(std::uint16_t address, bool on) noexcept {
    Pdu pdu;
    pdu.add8(static_cast<unsigned>(Function::write_coil));
    pdu.add16(address);
    pdu.add16(on ? 0xff00 : 0);
    return pdu;
}

Pdu write_register_request(std::uint16_t address, std::uint16_t value) noexcept {
    Pdu pdu;
    pdu.add8(static_cast<unsigned>(Function::write_register));
    pdu.add16(address);
    pdu.add16(value);
    return pdu;
}

Pdu write_registers_request(std::uint16_t address, std::span<const std::uint16_t> values) noexcept {
    Pdu pdu;
    pdu.add8(static_cast<unsigned>(Function::write_registers));
    pdu.add16(address);
    pdu.add16(static_cast<unsigned>(values.size()));
    pdu.add8(static_cast<unsigned>(values.size() * 2));
    for (const std::uint16_t value : values) {
        pdu.add16(value);
    }
    return pdu;
}

Pdu write_coils_request(std::uint16_t address, std::uint16_t count,
                        std::span<const std::uint8_t> bits) noexcept {
    Pdu pdu;
    pdu.add8(static_cast<unsigned>(Function::write_coils));
    pdu.add16(address);
    pdu.add16(count);
    pdu.add8(static_cast<unsigned>(bits.size()));
    for (const std::uint8_t eight : bits) {
        pdu.add8(eight);
    }
    return pdu;
}

Pdu huanyang_request(std::uint8_t function, std::span<const std::uint8_t> data) noexcept {
    Pdu pdu;
    pdu.add8(function);
    pdu.add8(static_cast<unsigned>(data.size()));
    for (const std::uint8_t byte : data) {
        pdu.add8(byte);
    }
    return pdu;
}

Answer decode(const Pdu& request, std::span<const std::uint8_t> answer, bool huanyang) noexcept {
    if (answer.size() < 2) return {};
    if (answer[0] == (request.function() | exception_flag)) {
        return answer.size() == 2 ? Answer{Verdict::exception, answer[1], {}} : Answer{};
    }
    if (answer[0] != request.function()) return {};
    if (huanyang) {
        if (answer.size() != answer[1] + 2U) return {};
        return {Verdict::good, 0, answer.subspan(2)};
    }
    if (reads(request.function())) return decode_read(request, answer);
    // writes are answered by the first five bytes of the request (clauses 6.5, 6.6, 6.11, 6.12)
    if (answer.size() != 5 || !std::equal(answer.begin(), answer.end(), request.bytes.begin())) {
        return {};
    }
    return {Verdict::good, 0, {}};
}

const char* exception_name(std::uint8_t code) noexcept {
    constexpr const char* names[] = {
        "unknown exception",  "illegal function",         "illegal data address",
        "illegal data value", "device failure",           "acknowledge, the request takes long",
        "device busy",        "unknown exception",        "memory parity error",
        "unknown exception",  "gateway path unavailable", "gateway target does not respond"};
    return names[code < std::size(names) ? code : 0];
}

std::string request_text(const Pdu& request) {
    constexpr const char* names[] = {"read coil",  "read discrete", "read holding",
                                     "read input", "write coil",    "write holding"};
    const std::uint8_t function = request.function();
    const bool single = function == 5 || function == 6;
    const char* name = "request";
    if (function >= 1 && function <= 6) {
        name = names[function - 1];
    } else if (function == static_cast<std::uint8_t>(Function::write_coils)) {
        name = "write coil";
    } else if (function == static_cast<std::uint8_t>(Function::write_registers)) {
        name = "write holding";
    }
    char text[64];
    if (request.size < 5) {
        std::snprintf(text, sizeof text, "function 0x%02X", function);
        return text;
    }
    const unsigned address = word_at(request.span(), 1);
    const unsigned count = single ? 1U : word_at(request.span(), 3);
    if (count <= 1) {
        std::snprintf(text, sizeof text, "%s 0x%04X", name, address);
    } else {
        std::snprintf(text, sizeof text, "%s 0x%04X..0x%04X", name, address, address + count - 1);
    }
    return text;
}

}  // namespace hal::modbus
