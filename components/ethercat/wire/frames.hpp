// SPDX-License-Identifier: MIT
// EtherCAT frames: Ethernet header, EtherCAT header, datagrams (ETG.1000.4, clause 5).
//
//     FrameWriter frame(buffer, source_address);                       // a frame with one datagram
//     if (std::uint8_t* data = frame.add(Command::brd, 7, 0x0130'0000, 2)) put<std::uint16_t>(data, 0);
//     port.send(frame.finish(), {}, now_ns);
//     ...
//     FrameReader reader(arrival->bytes);
//     while (auto datagram = reader.next()) take(datagram->index, datagram->data, datagram->wkc());
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "ethercat/wire/byte_order.hpp"

namespace hal::ethercat {

inline constexpr std::uint16_t ethertype = 0x88a4;  ///< also the UDP port, 34980
inline constexpr std::size_t ethernet_header_bytes = 14;
inline constexpr std::size_t ecat_header_bytes = 2;

inline constexpr std::size_t datagram_header_bytes = 10;
inline constexpr std::size_t wkc_bytes = 2;
inline constexpr std::size_t max_frame_bytes = 1514;  ///< without check sequence
/// Data bytes of the only datagram of a frame: 1500 - 2 - 12.
inline constexpr std::size_t max_datagram_data = 1486;

/// Types of the EtherCAT header, bits 12-15.
enum class Protocol : std::uint8_t { datagrams = 1, network_variables = 4, mailbox_gateway = 5 };

enum class Command : std::uint8_t {
    nop = 0,
    aprd = 1,
    apwr = 2,
    aprw = 3,
    fprd = 4,
    fpwr = 5,
    fprw = 6,
    brd = 7,
    bwr = 8,
    brw = 9,
    lrd = 10,
    lwr = 11,
    lrw = 12,
    armw = 13,
    frmw = 14
};
/// Returns "APRD" and the like, "unknown" for an undefined number. [any]
const char* to_string(Command) noexcept;
/// [any]
constexpr bool is_logical(Command c) noexcept {
    return c == Command::lrd || c == Command::lwr || c == Command::lrw;
}

/// A datagram in a frame. The pointers point into the frame.
struct DatagramView {
    Command command{};
    std::uint8_t index = 0;
    /// logical; or position or station in bits 0-15, register in bits 16-31
    std::uint32_t address = 0;
    std::uint16_t length = 0;
    bool circulating = false;
    bool more = false;
    std::uint8_t* header = nullptr;
    std::uint8_t* data = nullptr;

    /// or station address
    std::uint16_t position() const noexcept { return static_cast<std::uint16_t>(address); }
    std::uint16_t register_address() const noexcept {
        return static_cast<std::uint16_t>(address >> 16);
    }
    std::uint16_t event() const noexcept { return get<std::uint16_t>(header + 8); }
    std::uint16_t wkc() const noexcept { return get<std::uint16_t>(data + length); }
    void set_wkc(std::uint16_t wkc) const noexcept { put(data + length, wkc); }
};

/// Reads the datagrams of a frame. Accepts any bytes. [realtime]
class FrameReader {
public:
    /// `frame` from the destination address on. A UDP frame to port 34980 is read too.
    explicit FrameReader(std::span<std::uint8_t> frame) noexcept;
    /// Returns whether the header is that of a frame with datagrams.
    bool valid() const noexcept { return valid_; }
    /// Returns the next datagram; nullopt at the end, or where the lengths do not fit (then
    /// malformed() is true).
    std::optional<DatagramView> next() noexcept;
    bool malformed() const noexcept { return malformed_; }

private:
    std::uint8_t* at_ = nullptr;
    std::uint8_t* end_ = nullptr;
    bool valid_ = false;
    bool malformed_ = false;
    bool more_ = true;
};

/// Writes a frame of datagrams into a buffer of max_frame_bytes. [realtime]
class FrameWriter {
public:
    /// `max`: bytes of the longest frame.
    FrameWriter(std::span<std::uint8_t, max_frame_bytes> buffer,
                const std::array<std::uint8_t, 6>& source,
                std::size_t max = max_frame_bytes) noexcept;
    /// Returns a writer that continues the complete frame in a buffer, behind its datagrams.
    static FrameWriter behind(std::span<std::uint8_t, max_frame_bytes> buffer,
                              std::size_t max = max_frame_bytes) noexcept;
    /// Adds a datagram with zeroed data and WKC 0. Returns its data, or nullptr if the frame has no
    /// space left.
    std::uint8_t* add(Command command, std::uint8_t index, std::uint32_t address,
                      std::uint16_t length) noexcept;
    /// Returns the space left for data of one more datagram; 0: none.
    std::size_t space() const noexcept;
    bool empty() const noexcept { return last_ == nullptr; }
    /// Returns the complete frame, padded to 60 bytes.
    std::span<const std::uint8_t> finish() noexcept;

private:
    std::span<std::uint8_t, max_frame_bytes> buffer_;
    std::size_t max_;
    std::size_t used_ = ethernet_header_bytes + ecat_header_bytes;
    std::uint8_t* last_ = nullptr;  ///< header of the last datagram
};

/// Returns the address bits of a datagram to a position (0, 1, 2 … along the line) or station
/// address. [any]
constexpr std::uint32_t at_position(unsigned position, std::uint16_t address) noexcept {
    return static_cast<std::uint16_t>(-static_cast<int>(position)) |
           static_cast<std::uint32_t>(address) << 16;
}
constexpr std::uint32_t at_station(std::uint16_t station, std::uint16_t address) noexcept {
    return station | static_cast<std::uint32_t>(address) << 16;
}

}  // namespace hal::ethercat
