// SPDX-License-Identifier: MIT
#include "slcan_line.hpp"

#include "text/characters.hpp"

namespace hal::can::slcan {

namespace {

constexpr char digits[] = "0123456789ABCDEF";

/// Parses hexadecimal digits. Returns false for any other character.
bool number(std::string_view text, std::uint32_t& value) noexcept {
    value = 0;
    for (const char c : text) {
        const int digit = hex_digit(c);
        if (digit < 0) return false;
        value = value << 4 | static_cast<unsigned>(digit);
    }
    return true;
}

}  // namespace

/// The letter of the command that sends a frame with 11 bits of identifier.
static char command_of(const Frame& f) noexcept {
    if (f.fd) return f.bit_rate_switch ? 'b' : 'd';
    return f.remote ? 'r' : 't';
}

std::size_t encode(const Frame& f, Line& out) noexcept {
    std::size_t size = 0;
    const auto hex = [&](std::uint32_t v, int width) {
        while (width-- > 0) {
            out[size++] = digits[v >> width * 4 & 15U];
        }
    };
    const char letter = command_of(f);
    out[size++] = f.extended ? static_cast<char>(letter - 'a' + 'A') : letter;
    hex(f.id, f.extended ? 8 : 3);
    hex(code_of_length(f.length), 1);
    for (const auto b : f.bytes()) {
        hex(b, 2);
    }
    out[size++] = '\r';
    return size;
}

/// Sets the frame to an empty one of the kind that a letter begins. Returns false for any other
/// letter.
static bool set_kind(char letter, Frame& f) noexcept {
    f = {};
    f.extended = letter < 'a';
    const char kind = f.extended ? static_cast<char>(letter - 'A' + 'a') : letter;
    f.remote = kind == 'r';
    f.bit_rate_switch = kind == 'b';
    f.fd = kind == 'd' || f.bit_rate_switch;
    return f.remote || f.fd || kind == 't';
}

/// Parses the data, which a timestamp of 4 or 8 digits may follow. Returns false when invalid.
static bool set_data(std::string_view text, Frame& f) noexcept {
    const std::size_t digits_of_data = f.bytes().size() * 2;
    const std::size_t digits_of_time = text.size() - digits_of_data;
    if (digits_of_time != 0 && digits_of_time != 4 && digits_of_time != 8) return false;
    for (std::size_t i = 0; i < digits_of_data; i += 2) {
        std::uint32_t byte = 0;
        if (!number(text.substr(i, 2), byte)) return false;
        f.data[i / 2] = static_cast<std::uint8_t>(byte);
    }
    return true;
}

Decoder::Found Decoder::take(char c) noexcept {
    if (c == '\a') {
        size_ = 0;
        too_long_ = false;
        return Found::error;
    }
    if (c != '\r' && c != '\n') {
        if (size_ < text_.size()) {
            text_[size_++] = c;
        } else {
            too_long_ = true;
        }
        return Found::nothing;
    }
    const std::string_view text(text_.data(), size_);
    const bool complete = !too_long_;
    size_ = 0;
    too_long_ = false;
    return complete ? line(text) : Found::error;
}

Decoder::Found Decoder::line(std::string_view text) noexcept {
    if (text.empty()) return Found::nothing;
    // an adapter's "sent" may precede a frame on the same line
    if (text[0] == 'z' || text[0] == 'Z') {
        text.remove_prefix(1);
        if (text.empty()) return Found::nothing;
    }
    const char letter = text[0];
    if (letter == 'F' && text.size() == 3) {
        return number(text.substr(1), status_) ? Found::status : Found::error;
    }
    if (!set_kind(letter, frame_)) return Found::nothing;  // a command or its response
    const std::size_t width = frame_.extended ? 8 : 3;
    std::uint32_t code = 0;
    const bool has_head = text.size() >= width + 2 && number(text.substr(1, width), frame_.id) &&
                          number(text.substr(1 + width, 1), code);
    if (!has_head || (!frame_.fd && code > 8)) return Found::error;
    frame_.length = length_of_code(code);
    return set_data(text.substr(width + 2), frame_) && frame_.valid() ? Found::frame : Found::error;
}

const char* rate_command(std::uint32_t bit_rate) noexcept {
    constexpr struct {
        std::uint32_t rate;
        const char* command;
    } rates[] = {{10'000, "S0"},  {20'000, "S1"},  {50'000, "S2"},
                 {100'000, "S3"}, {125'000, "S4"}, {250'000, "S5"},
                 {500'000, "S6"}, {800'000, "S7"}, {1'000'000, "S8"}};
    for (const auto& r : rates) {
        if (r.rate == bit_rate) return r.command;
    }
    return nullptr;
}

}  // namespace hal::can::slcan
