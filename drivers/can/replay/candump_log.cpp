// SPDX-License-Identifier: MIT
// The candump log format: `(SECONDS.FRACTION) CHANNEL ID#DATA`, remote frames `ID#R` or `ID#R4`, FD `ID##FLAGSDATA`. Three digits are a
// standard identifier, eight an extended one, or an error frame if bit 29 is set.
#include <cstdio>

#include "link/capture.hpp"

namespace hal::can {

namespace {

bool hex(std::string_view text, std::uint32_t& value) {
    value = 0;
    for (const char c : text) {
        const auto digit = std::string_view("0123456789ABCDEFabcdef").find(c);
        if (digit == std::string_view::npos) return false;
        value = value << 4 | static_cast<std::uint32_t>(digit < 16 ? digit : digit - 6);
    }
    return !text.empty();
}

/// Parses the fraction; digits after the ninth are ignored.
bool time_of(std::string_view text, std::int64_t& ns) {
    std::int64_t whole = 0, fraction = 0, unit = 1'000'000'000;
    bool point = false, digits = false;
    for (const char c : text) {
        if (c == '.' && !point) {
            point = true;
        } else if (c >= '0' && c <= '9') {
            digits = true;
            if (!point) whole = whole * 10 + (c - '0');
            else if (unit > 1) unit /= 10, fraction += (c - '0') * unit;
            if (whole > 9'000'000'000) return false;
        } else {
            return false;
        }
    }
    ns = whole * 1'000'000'000 + fraction;
    return digits;
}

bool parse_frame(std::string_view text, Frame& f) {
    const auto mark = text.find('#');
    if (mark != 3 && mark != 8) return false;
    std::uint32_t id = 0;
    if (!hex(text.substr(0, mark), id)) return false;
    f.extended = mark == 8;
    f.error = f.extended && (id & 0x20000000U) != 0;
    if (f.error) f.extended = false, id &= 0x1fffffffU;
    f.id = id;
    text.remove_prefix(mark + 1);
    if (!text.empty() && text[0] == '#') {
        std::uint32_t flags = 0;
        if (text.size() < 2 || !hex(text.substr(1, 1), flags)) return false;
        f.fd = true;
        f.bit_rate_switch = (flags & 1) != 0;
        f.error_state = (flags & 2) != 0;
        text.remove_prefix(2);
    } else if (!text.empty() && (text[0] == 'R' || text[0] == 'r')) {
        f.remote = true;
        std::uint32_t length = 0;
        if (text.size() > 2 || (text.size() == 2 && !hex(text.substr(1), length))) return false;
        f.length = static_cast<std::uint8_t>(length);
        return f.valid();
    }
    if (text.size() % 2 != 0 || text.size() > (f.fd ? 128U : 16U)) return false;
    for (std::size_t i = 0; i < text.size(); i += 2) {
        std::uint32_t byte = 0;
        if (!hex(text.substr(i, 2), byte)) return false;
        f.data[f.length++] = static_cast<std::uint8_t>(byte);
    }
    return f.error || f.valid();
}

}  // namespace

std::string log_line(const Frame& f, std::string_view channel) {
    char text[256];
    const auto time = f.time_ns > 0 ? f.time_ns : 0;
    // Always six digits: canplayer reads the digits after the point as microseconds.
    const long long seconds = time / 1'000'000'000, microseconds = time % 1'000'000'000 / 1000;
    int size = std::snprintf(text, sizeof text, "(%010lld.%06lld) ", seconds, microseconds);
    std::string line(text, static_cast<std::size_t>(size));
    line += channel;
    size = std::snprintf(text, sizeof text, f.extended || f.error ? " %08X#" : " %03X#", f.id | (f.error ? 0x20000000U : 0U));
    line.append(text, static_cast<std::size_t>(size));
    if (f.fd) line += "#", line += static_cast<char>('0' + (f.bit_rate_switch ? 1 : 0) + (f.error_state ? 2 : 0));
    if (f.remote) line += f.length == 0 ? "R" : "R" + std::to_string(f.length);
    for (const auto b : f.bytes()) line += "0123456789ABCDEF"[b >> 4], line += "0123456789ABCDEF"[b & 15];
    return line;
}

bool parse_log_line(std::string_view line, Frame& f) {
    f = {};
    while (!line.empty() && (line.back() == '\r' || line.back() == ' ')) line.remove_suffix(1);
    if (line.size() >= 2 && (line.ends_with(" R") || line.ends_with(" T"))) line.remove_suffix(2);  // direction, as candump -x writes it
    if (line.empty() || line[0] != '(') return false;
    const auto close = line.find(')');
    if (close == line.npos || !time_of(line.substr(1, close - 1), f.time_ns)) return false;
    const auto space = line.rfind(' ');
    return space > close + 1 && parse_frame(line.substr(space + 1), f);
}

}  // namespace hal::can
