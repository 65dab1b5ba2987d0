// SPDX-License-Identifier: MIT
// Classic frames (ISO 11898-1): everything from start of frame to the end of the CRC is stuffed, so the length depends on the CRC.
// FD frames: stuffed up to the end of the data; stuff count and CRC have a fixed stuff bit before every four of their bits.
#include "link/timing.hpp"

namespace hal::can {

namespace {

constexpr unsigned classic_tail = 1 + 1 + 1 + 7 + intermission_bits;  // CRC delimiter, acknowledge, its delimiter, end of frame
constexpr unsigned fd_tail = classic_tail - 1;                        // the CRC delimiter counts to the data phase
constexpr unsigned crc_delimiter = 1;

/// Counts the stuff bits of a frame and computes its CRC-15, bit by bit.
class Bitstream {
public:
    void put(unsigned bit) noexcept {
        const unsigned next = bit ^ (crc_ >> 14 & 1U);
        crc_ = (crc_ << 1 & 0x7fffU) ^ (next != 0 ? 0x4599U : 0U);
        stuff();
        ++bits_;
        run_ = bit == last_ ? run_ + 1 : 1;
        last_ = bit;
    }
    void put(std::uint32_t value, unsigned width) noexcept {
        while (width-- > 0) put(value >> width & 1U);
    }
    /// Inserts a stuff bit that is due, except before a fixed stuff bit.
    void stuff() noexcept {
        if (run_ != 5) return;
        last_ ^= 1U;
        run_ = 1;
        ++bits_;
    }
    unsigned bits() const noexcept { return bits_; }
    std::uint32_t crc() const noexcept { return crc_; }

private:
    unsigned bits_ = 0, run_ = 0, last_ = 2;
    std::uint32_t crc_ = 0;
};

unsigned fixed_bits(unsigned length) noexcept {  // stuff count with parity, CRC, and their fixed stuff bits
    const unsigned crc = length > 16 ? 21 : 17;
    return 4 + crc + (4 + crc + 3) / 4;
}

void put_identifier(Bitstream& s, const Frame& f) noexcept {
    s.put(0U);  // start of frame
    if (!f.extended) {
        s.put(f.id, 11);
        s.put(f.remote ? 1U : 0U);
        s.put(0U);  // IDE
    } else {
        s.put(f.id >> 18, 11);
        s.put(3U, 2);  // SRR, IDE
        s.put(f.id & 0x3ffffU, 18);
        s.put(f.remote ? 1U : 0U);
    }
}

}  // namespace

Bits frame_bits(const Frame& f) noexcept {
    Bitstream s;
    put_identifier(s, f);
    const auto data = f.bytes();
    if (!f.fd) {
        s.put(0U, f.extended ? 2 : 1);  // r1, r0
        s.put(f.length < 8U ? f.length : 8U, 4);
        for (const auto byte : data.first(data.size() < 8 ? data.size() : 8)) s.put(byte, 8);
        s.put(s.crc(), 15);
        s.stuff();
        return {s.bits() + classic_tail, 0};
    }
    s.put(1U);  // FDF
    s.put(0U);  // res
    s.put(f.bit_rate_switch ? 1U : 0U);
    const unsigned slow = s.bits();
    s.put(f.error_state ? 1U : 0U);
    s.put(code_of_length(f.length), 4);
    for (const auto byte : data) s.put(byte, 8);
    const unsigned fast = s.bits() - slow + fixed_bits(f.length) + crc_delimiter;
    return f.bit_rate_switch ? Bits{slow + fd_tail, fast} : Bits{slow + fast + fd_tail, 0};
}

Bits worst_case_bits(unsigned length, bool extended, bool fd, bool bit_rate_switch, bool remote) noexcept {
    // The k-th stuff bit comes at the earliest after bit 4k + 1.
    if (!fd) {
        const unsigned stuffed = (extended ? 54U : 34U) + (remote ? 0U : 8U * (length < 8 ? length : 8U));
        return {stuffed + (stuffed - 1) / 4 + classic_tail, 0};
    }
    length = length_of_code(code_of_length(length));
    const unsigned slow = extended ? 36 : 17;
    const unsigned stuffed = slow + 5 + 8 * length;
    const unsigned all = (stuffed - 2) / 4, early = (slow - 2) / 4;  // none after the last data bit, where a fixed one follows
    const unsigned fast = stuffed - slow + fixed_bits(length) + crc_delimiter;
    if (!bit_rate_switch) return {slow + all + fast + fd_tail, 0};
    return {slow + early + fd_tail, fast + all - early};
}

std::int64_t duration_ns(Bits bits, std::uint32_t bit_rate, std::uint32_t data_rate) noexcept {
    if (bit_rate == 0) return 0;
    const std::uint64_t second = 1'000'000'000;
    const std::uint64_t slow = (bits.nominal * second + bit_rate - 1) / bit_rate;
    const std::uint64_t rate = data_rate != 0 ? data_rate : bit_rate;
    return static_cast<std::int64_t>(slow + (bits.data * second + rate - 1) / rate);
}

std::uint32_t arbitration_rank(const Frame& f) noexcept {
    const std::uint32_t request = f.remote ? 1 : 0;
    if (!f.extended) return f.id << 21 | request << 20;
    return (f.id >> 18) << 21 | 3U << 19 | (f.id & 0x3ffffU) << 1 | request;
}

}  // namespace hal::can
