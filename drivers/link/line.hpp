// SPDX-License-Identifier: MIT
// The seam to every line of bytes: serial lines, TCP connections, a line in memory. An address
// picks the driver. Code above this header does not know the kind of line; this header does not
// know the protocol of the bytes.
//
// Lines are used by threads that are not real time: a call never waits, but it may enter the kernel
// or take a lock.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>

namespace hal::line {

#pragma GCC visibility push(default)

enum class Parity : std::uint8_t { none, even, odd };

/// How characters are sent; drivers without characters ignore it.
struct Options {
    std::uint32_t baud = 19200;  ///< bit/s
    Parity parity = Parity::none;
    std::uint8_t stop_bits = 1;  ///< 1 or 2; a character has 8 data bits
    bool rs485 = false;  ///< the kernel switches the direction of an RS-485 transceiver
};

/// Returns the bits of a character with its start and stop bits. [any]
constexpr unsigned bits_per_character(const Options& o) noexcept {
    return 9U + o.stop_bits + (o.parity == Parity::none ? 0U : 1U);
}
/// Returns the duration of `count` characters in ns. [any]
constexpr std::int64_t characters_ns(const Options& o, std::size_t count) noexcept {
    return static_cast<std::int64_t>(count) * bits_per_character(o) * 1'000'000'000LL / o.baud;
}

struct Description {
    std::string address;
    std::string transport;  ///< "serial line", …; empty: an unknown driver
    bool is_stream = false;  ///< a TCP connection: no characters, no gaps
    bool in_memory = false;  ///< one process; its time is what its users pass in
};

/// One user's end of a line. Functions are called by one thread at a time. Times are in ns of the
/// clock of the user; all users of a line in memory have the same one.
class Line {
public:
    virtual ~Line() = default;
    virtual const Description& description() const noexcept = 0;
    /// Returns whether bytes can be sent. A line that was lost is opened again here, at most once
    /// in 0.5 s.
    virtual bool is_open(std::int64_t now_ns) noexcept = 0;
    /// Queues all bytes, or none: false.
    virtual bool send(std::span<const std::uint8_t> bytes, std::int64_t now_ns) noexcept = 0;
    /// Copies bytes that have arrived. Returns how many.
    virtual std::size_t receive(std::span<std::uint8_t> bytes, std::int64_t now_ns) noexcept = 0;
    /// Returns when the last sent byte has left the line.
    virtual std::int64_t sent_until_ns() const noexcept = 0;
    /// Returns what poll() waits for; -1: nothing.
    virtual int descriptor() const noexcept { return -1; }
};

struct Opened {
    std::unique_ptr<Line> line;
    std::string problem;
    bool is_in_use = false;  ///< the problem: another program has the line
    explicit operator bool() const noexcept { return line != nullptr; }
};

/// Opens `DRIVER:PLACE?key=value`. Keys are those of Options (`baud`, `format=8E1`, `rs485`) and
/// take precedence over them. [setup]
Opened open(std::string_view address, const Options& options = {});
/// Describes the line that open() would return, without opening it. [setup]
Description describe(std::string_view address);
/// Returns the address on which to wait for a user that opens `address`: `listen:HOST:PORT` for a
/// TCP connection; empty for lines that both ends open alike. [setup]
std::string listening_address(std::string_view address);
/// Parses 8N1, 8E1, 8O1, 8N2. Returns whether it is valid. [setup]
bool parse_format(std::string_view text, Options& options);
/// Returns "19200 8N1". [setup]
std::string format_text(const Options& options);

#pragma GCC visibility pop

}  // namespace hal::line
