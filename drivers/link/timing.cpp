// SPDX-License-Identifier: MIT
// Classic frames (ISO 11898-1): everything from start of frame to the end of the CRC is stuffed, so
// the length depends on the CRC. FD frames: stuffed up to the end of the data; stuff count and CRC
// have a fixed stuff bit before every four of their bits.
#include "link/timing.hpp"

#include <array>

namespace hal::can {

namespace {

// CRC delimiter, acknowledge, its delimiter, end of frame
constexpr unsigned classic_tail = 1 + 1 + 1 + 7 + intermission_bits;
// the CRC delimiter counts to the data phase
constexpr unsigned fd_tail = classic_tail - 1;
constexpr unsigned crc_delimiter = 1;

constexpr std::uint32_t next_crc(std::uint32_t crc, unsigned bit) noexcept {
    return (crc << 1 & 0x7fffU) ^ ((bit ^ (crc >> 14 & 1U)) != 0 ? 0x4599U : 0U);
}

/// Bits of equal value up to here, run 1..5 of 0 or of 1, as run | value << 3; and the stuff bits
/// inserted on the way here.
struct Run {
    std::uint8_t state = 0;
    std::uint8_t stuffed = 0;
};
constexpr Run next_run(Run r, unsigned bit) noexcept {
    if ((r.state & 7U) == 5) {
        r = {static_cast<std::uint8_t>((r.state & 8U) != 0 ? 1U : 9U),
             static_cast<std::uint8_t>(r.stuffed + 1U)};
    }
    const bool continues = r.state != 0 && r.state >> 3 == bit;
    r.state = static_cast<std::uint8_t>((continues ? (r.state & 7U) + 1U : 1U) | bit << 3);
    return r;
}

/// What eight bits at once do.
struct Tables {
    std::array<std::uint16_t, 256> crc{};
    std::array<std::array<Run, 256>, 16> run{};
};
constexpr Tables tables = [] {
    Tables t;
    for (unsigned byte = 0; byte < 256; ++byte) {
        std::uint32_t crc = 0;
        for (unsigned bit = 8; bit-- > 0;) {
            crc = next_crc(crc, byte >> bit & 1U);
        }
        t.crc[byte] = static_cast<std::uint16_t>(crc);
        for (unsigned from = 0; from < 16; ++from) {
            Run r{static_cast<std::uint8_t>(from), 0};
            for (unsigned bit = 8; bit-- > 0;) {
                r = next_run(r, byte >> bit & 1U);
            }
            t.run[from][byte] = r;
        }
    }
    return t;
}();

/// Counts the stuff bits of a frame and computes its CRC-15.
class Bitstream {
public:
    /// The first bits of a frame, which begin with start of frame, 0: as a byte, filled up by bits
    /// that change neither CRC nor run.
    template <unsigned width>
    void put_first(std::uint32_t value) noexcept {
        constexpr unsigned odd = width % 8;
        static_assert(odd != 0);
        const std::uint32_t byte = value >> (width - odd) & 0xffU;
        crc_ = tables.crc[byte];
        count(tables.run[0][byte | (0x55U << odd & 0xffU)]);
        bits_ += odd;
        for (unsigned left = width / 8; left-- > 0;) {
            put_byte(value >> 8 * left & 0xffU);
        }
    }
    template <unsigned width>
    void put(std::uint32_t value) noexcept {
        for (unsigned left = width; left % 8 != 0; --left) {
            const unsigned bit = value >> (left - 1) & 1U;
            crc_ = next_crc(crc_, bit);
            count(next_run({state_, 0}, bit));
        }
        bits_ += width % 8;
        for (unsigned left = width / 8; left-- > 0;) {
            put_byte(value >> 8 * left & 0xffU);
        }
    }
    void put_byte(unsigned byte) noexcept {
        crc_ = (crc_ << 8 & 0x7fffU) ^ tables.crc[(crc_ >> 7 ^ byte) & 0xffU];
        count(tables.run[state_][byte]);
        bits_ += 8;
    }
    unsigned bits() const noexcept { return bits_; }
    std::uint32_t crc() const noexcept { return crc_; }

private:
    void count(Run r) noexcept {
        state_ = r.state;
        bits_ += r.stuffed;
    }

    unsigned bits_ = 0;
    std::uint8_t state_ = 0;
    std::uint32_t crc_ = 0;
};

// stuff count with parity, CRC, and their fixed stuff bits
unsigned fixed_bits(unsigned length) noexcept {
    const unsigned crc = length > 16 ? 21 : 17;
    return 4 + crc + (4 + crc + 3) / 4;
}

/// Puts start of frame, identifier and the flags behind it, and the bits that follow: `width` in a
/// base frame, `extended_width` in an extended one.
template <unsigned width, unsigned extended_width>
void put_head(Bitstream& s, const Frame& f, std::uint32_t next) noexcept {
    const std::uint32_t request = f.remote ? 1U : 0U;
    // RTR, IDE
    if (!f.extended) {
        return s.put_first<1 + 11 + 2 + width>(((f.id & 0x7ffU) << 2 | request << 1) << width |
                                               next);
    }
    s.put_first<1 + 11 + 2>((f.id >> 18 & 0x7ffU) << 2 | 3U);  // SRR, IDE
    s.put<18 + 1 + extended_width>(((f.id & 0x3ffffU) << 1 | request) << extended_width | next);
}

}  // namespace

Bits frame_bits(const Frame& f) noexcept {
    Bitstream s;
    const auto data = f.bytes();
    if (!f.fd) {
        put_head<1 + 4, 2 + 4>(s, f, f.length < 8U ? f.length : 8U);  // r1, r0, DLC
        for (const auto byte : data.first(data.size() < 8 ? data.size() : 8)) {
            s.put_byte(byte);
        }
        // a stuff bit may be due before the delimiter
        s.put<15 + crc_delimiter>(s.crc() << 1 | 1U);
        return {s.bits() + classic_tail - crc_delimiter, 0};
    }
    put_head<3, 3>(s, f, f.bit_rate_switch ? 5U : 4U);  // FDF, res, BRS
    const unsigned slow = s.bits();
    s.put<1 + 4>(code_of_length(f.length) | (f.error_state ? 16U : 0U));  // ESI, DLC
    for (const auto byte : data) {
        s.put_byte(byte);
    }
    const unsigned fast = s.bits() - slow + fixed_bits(f.length) + crc_delimiter;
    return f.bit_rate_switch ? Bits{slow + fd_tail, fast} : Bits{slow + fast + fd_tail, 0};
}

Bits worst_case_bits(unsigned length, bool extended, bool fd, bool bit_rate_switch,
                     bool remote) noexcept {
    // The k-th stuff bit comes at the earliest after bit 4k + 1.
    if (!fd) {
        const unsigned bytes = length < 8 ? length : 8U;
        const unsigned head = extended ? 54U : 34U;
        const unsigned stuffed = remote ? head : head + 8U * bytes;
        return {stuffed + (stuffed - 1) / 4 + classic_tail, 0};
    }
    length = length_of_code(code_of_length(length));
    const unsigned slow = extended ? 36 : 17;
    const unsigned stuffed = slow + 5 + 8 * length;
    // none after the last data bit, where a fixed one follows
    const unsigned all = (stuffed - 2) / 4;
    const unsigned early = (slow - 2) / 4;
    const unsigned fast = stuffed - slow + fixed_bits(length) + crc_delimiter;
    if (!bit_rate_switch) {
        return {slow + all + fast + fd_tail, 0};
    }
    return {slow + early + fd_tail, fast + all - early};
}

std::int64_t duration_ns(Bits bits, std::uint32_t bit_rate, std::uint32_t data_rate) noexcept {
    if (bit_rate == 0) return 0;
    const std::uint64_t second = 1'000'000'000;
    const std::uint64_t slow = (bits.nominal * second + bit_rate - 1) / bit_rate;
    if (bits.data == 0) {
        return static_cast<std::int64_t>(slow);  // a division less
    }
    const std::uint64_t rate = data_rate != 0 ? data_rate : bit_rate;
    return static_cast<std::int64_t>(slow + (bits.data * second + rate - 1) / rate);
}

std::uint32_t arbitration_rank(const Frame& f) noexcept {
    const std::uint32_t request = f.remote ? 1 : 0;
    if (!f.extended) return f.id << 21 | request << 20;
    return (f.id >> 18) << 21 | 3U << 19 | (f.id & 0x3ffffU) << 1 | request;
}

}  // namespace hal::can
