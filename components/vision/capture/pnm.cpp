// SPDX-License-Identifier: MIT
#include "vision/capture/pnm.hpp"

#include <algorithm>

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

std::uint8_t scaled(unsigned sample, unsigned max) {
    return static_cast<std::uint8_t>(max == 255 ? sample : (sample * 255u + max / 2) / max);
}

/// Frames have blue first, files red.
std::size_t pixel_index(std::size_t sample, bool colour) {
    return colour ? sample + 2 - 2 * (sample % 3) : sample;
}

struct Header {
    bool colour = false;
    bool plain = false;  ///< decimal numbers, not bytes
    int width = 0;
    int height = 0;
    int max = 0;         ///< value of white

    std::size_t samples() const {
        return static_cast<std::size_t>(width) * static_cast<std::size_t>(height) *
               (colour ? 3 : 1);
    }
    std::size_t sample_bytes() const { return max > 255 ? 2 : 1; }
    /// one white space before binary samples
    std::size_t separator_bytes() const { return plain ? 0 : 1; }
    /// of the samples; plain: at least a digit and a space each
    std::size_t min_bytes() const { return plain ? 2 * samples() : samples() * sample_bytes(); }
};

bool has_magic(const std::uint8_t* bytes, std::size_t count) {
    if (count < 2 || bytes[0] != 'P') return false;
    const std::uint8_t kind = bytes[1];
    return kind == '2' || kind == '3' || kind == '5' || kind == '6';
}

/// Reader::number() reads up to 65535.
std::string size_text(int size) { return size > 65535 ? "more than 65535" : std::to_string(size); }

std::optional<Problem> read_header(Reader& reader, Header& header) {
    for (int* const value : {&header.width, &header.height, &header.max}) {
        *value = reader.number();
        if (*value < 0) return damaged("its header is truncated before width, height and maximum");
    }
    if (header.width == 0 || header.height == 0 || header.max == 0 || header.max > 65535) {
        return damaged("invalid header: a value is 0, or the maximum exceeds 65535");
    }
    if (!Frame::fits(header.width, header.height)) {
        return Problem{FrameError::too_large,
                       "a frame of " + size_text(header.width) + " x " + size_text(header.height) +
                           " is larger than " + std::to_string(max_width) + " x " +
                           std::to_string(max_height) + " or 22 million pixels"};
    }
    if (reader.left() < header.separator_bytes() + header.min_bytes()) {
        const std::size_t of_samples =
            reader.left() - std::min(reader.left(), header.separator_bytes());
        return damaged("truncated: " + std::to_string(of_samples) + " of " +
                       std::to_string(header.min_bytes()) + " bytes");
    }
    return std::nullopt;
}

/// Returns -1 for text that is not a number.
int read_sample(Reader& reader, const Header& header) {
    if (header.plain) return reader.number();
    const std::uint8_t* const p = reader.take(header.sample_bytes());
    return header.sample_bytes() == 2 ? p[0] << 8 | p[1] : p[0];
}
}  // namespace

std::optional<Problem> read_pnm(const std::uint8_t* bytes, std::size_t count, Frame& frame) {
    if (!has_magic(bytes, count)) {
        return damaged("invalid PGM or PPM: it does not begin with P2, P3, P5 or P6");
    }
    Header header;
    header.colour = bytes[1] == '3' || bytes[1] == '6';
    header.plain = bytes[1] < '5';
    Reader reader(bytes + 2, count - 2);
    if (auto problem = read_header(reader, header)) return problem;
    frame.resize(header.width, header.height, header.colour ? Format::bgr : Format::grey);
    if (!header.plain) {
        reader.take(header.separator_bytes());
    }
    const std::size_t samples = header.samples();
    for (std::size_t i = 0; i < samples; ++i) {
        const int sample = read_sample(reader, header);
        if (sample < 0) {
            return damaged("sample " + std::to_string(i + 1) + " of " + std::to_string(samples) +
                           " is not a number");
        }
        if (sample > header.max) {
            return damaged("a sample exceeds the maximum given in the header");
        }
        frame.pixels[pixel_index(i, header.colour)] =
            scaled(static_cast<unsigned>(sample), static_cast<unsigned>(header.max));
    }
    return std::nullopt;
}

std::string write_pnm(const Frame& frame) {
    const bool colour = frame.format == Format::bgr;
    std::string text = std::string(colour ? "P6\n" : "P5\n") + std::to_string(frame.width) + " " +
                       std::to_string(frame.height) + "\n255\n";
    for (std::size_t i = 0; i < frame.pixels.size(); ++i) {
        text += static_cast<char>(frame.pixels[pixel_index(i, colour)]);
    }
    return text;
}

}  // namespace hal::vision
