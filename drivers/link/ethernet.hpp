// SPDX-License-Identifier: MIT
// The seam to every Ethernet segment: frames, launch times, timestamps, link state, statistics. An
// address picks the driver:
// `eth:enp3s0` a real interface, `sim:NAME` a segment in memory with exact wire times, `udp:HOST`
// frames in UDP datagrams, `replay:FILE` a capture. A user of `sim:NAME` is a station of its own;
// all users of `sim:NAME/STATION` share that station's line and address, as the users of one
// interface do.
//
//     auto opened = hal::ethernet::open("eth:enp3s0", {.types = {0x9021}});   // [setup]
//     if (!opened) throw std::runtime_error(opened.problem);
//     ...
//     while (auto arrival = port.receive(now_ns)) take(*arrival);             // in the cycle; now_ns is the start of the cycle
//     port.send(frame, {.at_ns = slot_ns, .stamp_at = 22}, now_ns);           // leaves in its slot, stamped as it leaves
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace hal::ethernet {

#pragma GCC visibility push(default)

/// Value of `now_ns` for threads without a cycle, which do not know the runtime's time. A segment
/// in memory uses the newest time it knows.
inline constexpr std::int64_t unclocked = INT64_MIN;

using Address = std::array<std::uint8_t, 6>;
inline constexpr Address broadcast{0xff, 0xff, 0xff, 0xff, 0xff, 0xff};

inline constexpr std::size_t header_bytes = 14;  ///< destination, source, type
/// without the check sequence; shorter ones are padded with zeros
inline constexpr std::size_t smallest_frame = 60;
inline constexpr std::size_t max_frame = 1514;

/// Returns the bytes of line time that a frame of `length` bytes (without check sequence) takes,
/// including preamble, check sequence and gap, at least 84 (IEEE 802.3 clause 4.2.3.2, 4.4.2).
/// [any]
constexpr std::size_t wire_bytes(std::size_t length) noexcept {
    return (length < smallest_frame ? smallest_frame : length) + 24;
}

/// A received frame. `bytes` is valid until the next receive() or wait() on the same port.
struct Arrival {
    /// from the destination address on, without check sequence
    std::span<const std::uint8_t> bytes;
    /// time of arrival in ns, stamped by the kernel or the segment, on the clock of `now_ns`
    std::int64_t time_ns = 0;
};

/// Completes a frame just before it leaves: its number, a check sequence over it. A frame dropped
/// while waiting is not completed.
class Finisher {
public:
    virtual ~Finisher() = default;
    /// Completes a frame that leaves now; `frame` is not padded. [realtime] any thread
    virtual void leaves(std::span<std::uint8_t> frame) noexcept = 0;
    /// Reverts the newest leaves() of this frame: the system did not take it. [realtime] any thread
    virtual void stayed(std::span<const std::uint8_t> frame) noexcept = 0;
};

/// When and how a frame leaves.
struct Launch {
    std::int64_t at_ns = 0;  ///< launch time in ns; 0: at once
    /// maximum lateness in ns; a later frame is dropped and counted as late; 0: no limit
    std::int64_t guard_ns = 0;
    /// offset in the frame where the time of sending is written, 8 bytes, big endian; 0: none
    std::uint16_t stamp_at = 0;
    std::int64_t stamp_add_ns =
        0;  ///< offset from the clock of `now_ns` to that of the receiver, ns
    Finisher* finisher = nullptr;  ///< must outlive the port; nullptr: the frame is complete

    /// Returns true when `length` is that of a frame with space for the stamp. [any]
    bool fits(std::size_t length) const noexcept {
        return length >= header_bytes && (stamp_at == 0 || stamp_at + std::size_t{8} <= length);
    }
    /// Returns true when `time_ns` is beyond the guard. [any]
    bool is_late(std::int64_t time_ns) const noexcept {
        return at_ns != 0 && guard_ns > 0 && time_ns > at_ns + guard_ns;
    }
};

/// Result of send().
enum class Sent : std::uint8_t {
    queued,  ///< sent, or will be at its time
    full,  ///< dropped and counted: queue full, or too far ahead for a port without pacer
    late,  ///< dropped and counted: its time and guard had passed
    down,  ///< dropped and counted: no link
    rejected,  ///< dropped and counted: longer than the MTU, or shorter than a header
};
/// Returns "queued", "full", "late", "down" or "rejected". [any]
const char* to_string(Sent) noexcept;

/// Statistics of a port; counts start at open().
struct Statistics {
    bool up = true;  ///< the link has a carrier
    std::uint32_t speed = 0;  ///< Mbit/s; 0: unknown
    std::uint32_t mtu = 1500;
    std::uint64_t sent = 0;
    std::uint64_t sent_bytes = 0;
    std::uint64_t received = 0;
    std::uint64_t received_bytes = 0;
    std::uint64_t lost = 0;  ///< frames of others lost here, as far as known
    std::uint64_t dropped = 0;  ///< own frames that did not leave, except late ones
    std::uint64_t late = 0;  ///< own frames dropped because their time had passed
    std::uint64_t errors = 0;  ///< frames too short or too long, failed calls
    std::uint64_t downs = 0;  ///< losses of the link
    std::int64_t launch_error_ns = 0;  ///< lateness of the newest timed frame, ns
    /// departure of the newest frame by the kernel's stamp, ns; 0: not requested, or unsupported
    std::int64_t departure_ns = 0;
};

/// How wait() waits.
enum class Policy : std::uint8_t {
    hybrid,  ///< sleeps until `spin_ns` before the end, then spins
    block,  ///< sleeps until a frame or the end
    spin,  ///< spins: for an isolated CPU
};

/// Options of open(); options in the address take precedence.
struct Options {
    std::vector<std::uint16_t> types{};  ///< received Ethertypes; empty: all
    /// own address on a segment in memory; zeros: assigned. Ignored on a real interface
    Address address{};
    Policy policy = Policy::hybrid;
    std::int64_t spin_ns = 150'000;
    /// a thread of the port launches frames at their time; without it send() waits at
    bool pacer = false;
    ///< most `spin_ns` for the time and rejects frames further
    ///< ahead
    int pacer_priority = 80;
    int pacer_cpu = -1;
    /// the kernel stamps sent frames: exact times in Statistics, for two system calls per frame
    bool transmit_stamps = false;
    bool promiscuous = false;  ///< also receives frames for other stations
    /// the end that others address: `udp:` binds to HOST. Ignored on other transports
    bool listen = false;
    /// Mbit/s of a segment in memory; 0: unchanged, 100 for a new one
    std::uint32_t speed = 0;
    std::int64_t forward_ns = -1;  ///< delay of its switch; -1: unchanged, 2 us for a new one
    /// noise (sigma) of the timestamps of this port on a segment in memory, as of a kernel
    std::int64_t noise_ns = 0;
    std::size_t send_capacity = 64;  ///< frames
    std::size_t receive_capacity = 256;  ///< frames
};

/// Description of a port and its capabilities.
struct Description {
    std::string address;  ///< as opened, without options: equal for all ports that share a line
    /// "raw Ethernet", "segment in memory", "frames in UDP datagrams", "capture"
    std::string transport;
    std::string interface{};
    bool simulated = false;  ///< no hardware, time is the runtime's
    std::string remark{};  ///< a missing capability, as a sentence; empty: none
    bool in_memory = false;  ///< a segment in memory: a user may choose its own address
    bool datagrams = false;  ///< UDP: has a link while a program listens at the other end
    bool recorded = false;  ///< a capture: frames sent reach nobody
    bool paced = false;  ///< Options::pacer gives it a thread that launches frames
};

class Segment;  // link/segment.hpp

/// One user's end of a segment. Opened and destroyed in setup. One thread sends, one receives; they
/// may be different threads. No function locks or allocates, except those marked [setup]; none
/// waits except wait() and a send() whose time is near.
class Port {
public:
    virtual ~Port() = default;
    Port() = default;
    Port(const Port&) = delete;
    Port& operator=(const Port&) = delete;

    /// Returns the address of the station. [any]
    virtual const Address& address() const noexcept = 0;
    /// Sends a complete frame (destination, source, type, payload), which is copied. [realtime]
    /// sender
    virtual Sent send(std::span<const std::uint8_t> frame, const Launch& launch,
                      std::int64_t now_ns) noexcept = 0;
    /// Returns the next frame in order of arrival, or nullopt. [realtime] receiver
    virtual std::optional<Arrival> receive(std::int64_t now_ns) noexcept = 0;
    /// Waits by the port's policy until receive() has a frame or the time has come. Returns true
    /// when it has. Not on a segment in memory, where time does not pass by waiting. [realtime]
    /// receiver, in a thread or function whose job it is to wait
    virtual bool wait(std::int64_t until_ns) noexcept = 0;

    /// Returns the statistics. [any]
    virtual Statistics statistics() const noexcept = 0;
    /// Returns the description. [setup]
    virtual const Description& description() const noexcept = 0;
    /// Returns a descriptor that polls readable when a frame may have arrived, or -1. [setup]
    virtual int descriptor() const noexcept { return -1; }
    /// Returns the fault injection of a segment in memory; nullptr on all others. [setup]
    virtual Segment* segment() noexcept { return nullptr; }
};

/// A port, or in `problem` a sentence with place, cause and what to type.
struct Opened {
    std::unique_ptr<Port> port;
    std::string problem;
    explicit operator bool() const noexcept { return port != nullptr; }
};

/// Opens `DRIVER:PLACE` or `DRIVER:PLACE?key=value&…`: `speed=100`, `policy=block`, `spin=50us`,
/// `mac=02:00:00:00:00:07`,
/// `pacer`, `priority=80`, `cpu=1`, `promiscuous`, `txstamps`, `sendqueue=64`, `receivequeue=256`,
/// `forward=2us`, `noise=1us`. They take precedence over `options`. [setup]
Opened open(std::string_view address, const Options& options = {});
/// Describes the port that open() would return, as far as the address determines it, without
/// opening it. `transport` is empty for an unknown driver. [setup]
Description describe(std::string_view address);

/// Convert an address to "02:00:00:00:00:07" and back; nullopt for an invalid text. [any]
std::string to_string(const Address&);

std::optional<Address> parse_address(std::string_view text) noexcept;

#pragma GCC visibility pop

}  // namespace hal::ethernet
