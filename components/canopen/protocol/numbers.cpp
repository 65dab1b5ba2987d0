// SPDX-License-Identifier: MIT
#include "numbers.hpp"

#include <array>

#include "text/text_table.hpp"

namespace hal::canopen {

const char* to_string(NmtState state) noexcept {
    constexpr TextRow<NmtState> texts[] = {
        {NmtState::initialising, "initialising"},
        {NmtState::stopped, "stopped"},
        {NmtState::operational, "operational"},
        {NmtState::pre_operational, "pre-operational"},
    };
    return find_text(texts, state, "unknown");
}

const char* to_string(NmtCommand command) noexcept {
    constexpr TextRow<NmtCommand> texts[] = {
        {NmtCommand::start, "start"},
        {NmtCommand::stop, "stop"},
        {NmtCommand::enter_pre_operational, "enter pre-operational"},
        {NmtCommand::reset_node, "reset node"},
        {NmtCommand::reset_communication, "reset communication"},
    };
    return find_text(texts, command, nullptr);
}

namespace {
constexpr std::array<std::uint16_t, 256> crc_table = [] {
    std::array<std::uint16_t, 256> table{};
    for (unsigned byte = 0; byte < 256; ++byte) {
        unsigned crc = byte << 8;
        for (int bit = 0; bit < 8; ++bit) {
            crc = (crc & 0x8000) != 0 ? (crc << 1) ^ 0x1021 : crc << 1;
        }
        table[byte] = static_cast<std::uint16_t>(crc);
    }
    return table;
}();
}  // namespace

std::uint16_t crc16(std::span<const std::uint8_t> data, std::uint16_t crc) noexcept {
    for (const auto byte : data) {
        crc = static_cast<std::uint16_t>(crc << 8 ^ crc_table[(crc >> 8 ^ byte) & 0xff]);
    }
    return crc;
}

}  // namespace hal::canopen
