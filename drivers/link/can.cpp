// SPDX-License-Identifier: MIT
#include "link/can.hpp"

#include <cstdio>

namespace hal::can {

namespace {
constexpr std::uint8_t fd_lengths[] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 20, 24, 32, 48, 64};
}

std::uint8_t length_of_code(unsigned code) noexcept { return fd_lengths[code < 15 ? code : 15]; }

std::uint8_t code_of_length(std::size_t length) noexcept {
    std::uint8_t code = 0;
    while (code < 15 && fd_lengths[code] < length) {
        ++code;
    }
    return code;
}

bool Frame::valid() const noexcept {
    if (error || id > (extended ? 0x1fffffffU : 0x7ffU)) return false;
    if (fd) return !remote && length <= 64 && length_of_code(code_of_length(length)) == length;
    return length <= 8 && !bit_rate_switch && !error_state;
}

bool Frame::same(const Frame& other) const noexcept {
    return id == other.id && length == other.length && extended == other.extended &&
           remote == other.remote && fd == other.fd && bit_rate_switch == other.bit_rate_switch &&
           error == other.error && std::memcmp(data.data(), other.data.data(), bytes().size()) == 0;
}

const char* to_string(State state) noexcept {
    constexpr const char* words[] = {"active", "warning", "passive", "bus off", "down"};
    return words[static_cast<std::size_t>(state)];
}

const char* to_string(Sent sent) noexcept {
    constexpr const char* words[] = {"queued", "full", "bus off", "down", "rejected"};
    return words[static_cast<std::size_t>(sent)];
}

/// Names a frame that only a master sends, by its identifier (CiA 301).
static const char* name_of_command(std::uint32_t id) noexcept {
    switch (id) {
    case 0x000: return "NMT command";
    case 0x080: return "SYNC";
    case 0x100: return "TIME";
    default: return "set-point";
    }
}

std::string to_string(const Rejected& r) {
    char address[18];
    std::snprintf(
        address, sizeof address, "%02x:%02x:%02x:%02x:%02x:%02x",
        static_cast<unsigned>(r.from >> 40 & 0xff), static_cast<unsigned>(r.from >> 32 & 0xff),
        static_cast<unsigned>(r.from >> 24 & 0xff), static_cast<unsigned>(r.from >> 16 & 0xff),
        static_cast<unsigned>(r.from >> 8 & 0xff), static_cast<unsigned>(r.from & 0xff));
    const std::string who = address;
    char command[40];
    std::snprintf(command, sizeof command, "%s (%03Xh)", name_of_command(r.id),
                  static_cast<unsigned>(r.id));
    std::string sentence;
    switch (r.why) {
    case Rejected::Why::not_the_master:
        sentence = std::string("rejected ") + command + " from " + who +
                   ": not the master; to allow it: also=" + who + " in the link";
        break;
    case Rejected::Why::out_of_slot:
        sentence =
            std::string("rejected ") + command + " from " + who + ": not in a slot of that station";
        break;
    case Rejected::Why::unknown_station:
        sentence = "rejected frame from " + who + ": unknown station";
        break;

    case Rejected::Why::unsigned_frame:
        sentence = "rejected frame from " + who + ": not signed (key=)";
        break;
    case Rejected::Why::wrong_tag:
        sentence = "rejected frame from " + who + ": signed with another key, or modified";
        break;
    case Rejected::Why::replayed:
        sentence = "rejected frame from " + who + ": replayed, or its clock was set back";
        break;
    }
    if (r.count > 1) {
        sentence += "; " + std::to_string(r.count) + " frames since the last report";
    }
    return sentence;
}

}  // namespace hal::can
