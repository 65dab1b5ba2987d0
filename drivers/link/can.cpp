// SPDX-License-Identifier: MIT
#include "link/can.hpp"

namespace hal::can {

namespace {
constexpr std::uint8_t fd_lengths[] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 20, 24, 32, 48, 64};
}

std::uint8_t length_of_code(unsigned code) noexcept { return fd_lengths[code < 15 ? code : 15]; }

std::uint8_t code_of_length(std::size_t length) noexcept {
    std::uint8_t code = 0;
    while (code < 15 && fd_lengths[code] < length) ++code;
    return code;
}

bool Frame::valid() const noexcept {
    if (error || id > (extended ? 0x1fffffffU : 0x7ffU)) return false;
    if (fd) return !remote && length <= 64 && length_of_code(code_of_length(length)) == length;
    return length <= 8 && !bit_rate_switch && !error_state;
}

bool Frame::same(const Frame& other) const noexcept {
    return id == other.id && length == other.length && extended == other.extended && remote == other.remote && fd == other.fd &&
           bit_rate_switch == other.bit_rate_switch && error == other.error &&
           std::memcmp(data.data(), other.data.data(), bytes().size()) == 0;
}

const char* word(State state) noexcept {
    constexpr const char* words[] = {"active", "warning", "passive", "bus off", "down"};
    return words[static_cast<std::size_t>(state)];
}

const char* word(Sent sent) noexcept {
    constexpr const char* words[] = {"queued", "full", "bus off", "down", "refused"};
    return words[static_cast<std::size_t>(sent)];
}

}  // namespace hal::can
