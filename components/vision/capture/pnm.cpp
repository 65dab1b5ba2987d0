// SPDX-License-Identifier: MIT
#include "vision/capture/pnm.hpp"

namespace hal::vision {
namespace {

bool space(std::uint8_t c) { return c == ' ' || (c >= '\t' && c <= '\r'); }

class Reader {
public:
    Reader(const std::uint8_t* bytes, std::size_t count) : at_(bytes), end_(bytes + count) {}

    std::size_t left() const { return static_cast<std::size_t>(end_ - at_); }
    const std::uint8_t* take(std::size_t count) {
        const std::uint8_t* const here = at_;
        at_ += count;
        return here;
    }
    /// A decimal number behind white space and comments; -1 without a number, 65536 when it is
    /// larger than 65535.
    int number() {
        for (; at_ != end_; ++at_) {
            if (*at_ == '#') {
                while (at_ != end_ && *at_ != '\n') {
                    ++at_;
                }
            }
            if (at_ == end_ || !space(*at_)) break;
        }
        if (at_ == end_ || *at_ < '0' || *at_ > '9') return -1;
        int value = 0;
        for (; at_ != end_ && *at_ >= '0' && *at_ <= '9'; ++at_) {
            value = value > 65535 ? 65536 : value * 10 + (*at_ - '0');
        }
        return value > 65535 ? 65536 : value;
    }

private:
    const std::uint8_t *at_, *end_;
};

Problem damaged(std::string text) { return {FrameError::damaged, std::move(text)}; }

std::uint8_t scaled(unsigned sample, unsigned most) {
    return static_cast<std::uint8_t>(most == 255 ? sample : (sample * 255u + most / 2) / most);
}
}  // namespace

std::optional<Problem> read_pnm(const std::uint8_t* bytes, std::size_t count, Frame& frame) {
    if (count < 2 || bytes[0] != 'P' ||
        (bytes[1] != '2' && bytes[1] != '3' && bytes[1] != '5' && bytes[1] != '6')) {
        return damaged("invalid PGM or PPM: it does not begin with P2, P3, P5 or P6");
    }
    const bool colour = bytes[1] == '3' || bytes[1] == '6';
    const bool plain = bytes[1] < '5';
    Reader reader(bytes + 2, count - 2);
    const int width = reader.number();
    const int height = width < 0 ? -1 : reader.number();

    const int most = height < 0 ? -1 : reader.number();
    if (most < 0) return damaged("its header is truncated before width, height and maximum");
    if (width == 0 || height == 0 || most == 0 || most > 65535) {
        return damaged("invalid header: a value is 0, or the maximum exceeds 65535");
    }
    if (!Frame::fits(width, height)) {
        return Problem{FrameError::too_large,
                       "a frame of " + std::to_string(width) + " x " + std::to_string(height) +
                           " is larger than " + std::to_string(most_wide) + " x " +
                           std::to_string(most_high) + " or 22 million pixels"};
    }
    const std::size_t samples =
        static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * (colour ? 3 : 1);
    const std::size_t wide = most > 255 ? 2 : 1;
    // binary: one white space, then the samples; plain: at least a digit and a space each
    const std::size_t needed = plain ? 2 * samples : 1 + samples * wide;
    if (reader.left() < needed) {
        return damaged("truncated: " + std::to_string(reader.left()) + " of " +
                       std::to_string(needed) + " bytes");
    }
    frame.resize(width, height, colour ? Format::bgr : Format::grey);
    if (!plain) {
        reader.take(1);
    }
    for (std::size_t i = 0; i < samples; ++i) {
        int sample;
        if (plain) {
            sample = reader.number();
        } else {
            const std::uint8_t* const p = reader.take(wide);
            sample = wide == 2 ? p[0] << 8 | p[1] : p[0];
        }
        if (sample < 0) {
            return damaged("sample " + std::to_string(i + 1) + " of " + std::to_string(samples) +
                           " is not a number");
        }
        if (sample > most) return damaged("a sample exceeds the maximum given in the header");
        // files have red first, frames blue
        frame.pixels[colour ? i + 2 - 2 * (i % 3) : i] =
            scaled(static_cast<unsigned>(sample), static_cast<unsigned>(most));
    }
    return std::nullopt;
}

std::string write_pnm(const Frame& frame) {
    const bool colour = frame.format == Format::bgr;
    std::string text = std::string(colour ? "P6\n" : "P5\n") + std::to_string(frame.width) + " " +
                       std::to_string(frame.height) + "\n255\n";
    for (std::size_t i = 0; i < frame.pixels.size(); ++i) {
        text += static_cast<char>(frame.pixels[colour ? i + 2 - 2 * (i % 3) : i]);
    }
    return text;
}

}  // namespace hal::vision
