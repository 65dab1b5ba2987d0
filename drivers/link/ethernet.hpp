// SPDX-License-Identifier: MIT
// The seam to every Ethernet segment: frames, launch times, timestamps, link state, statistics. An address picks the driver:
// `eth:enp3s0` a real interface, `sim:NAME` a segment in memory with true wire times, `replay:FILE` a capture. Who opens `sim:NAME` is
// a station of its own; all who open `sim:NAME/STATION` share that station's line and address, as the users of one interface do.
//
//     auto opened = hal::ethernet::open("eth:enp3s0", {.types = {0x9021}});   // [setup]
//     if (!opened) throw std::runtime_error(opened.problem);
//     ...
//     while (auto arrival = port.receive(now_ns)) take(*arrival);             // in the cycle; now_ns is the start of the cycle
//     port.send(frame, {.at_ns = slot_ns, .stamp_at = 22}, now_ns);           // leaves in its slot, stamped when it leaves
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

/// "I have no cycle": as `now_ns`, for threads that do not know the runtime's time. A segment in memory takes the newest it was told.
inline constexpr std::int64_t unclocked = INT64_MIN;

using Address = std::array<std::uint8_t, 6>;
inline constexpr Address broadcast{0xff, 0xff, 0xff, 0xff, 0xff, 0xff};

inline constexpr std::size_t header_bytes = 14;   ///< destination, source, type
inline constexpr std::size_t smallest_frame = 60; ///< without the check sequence; the driver pads with zeros
inline constexpr std::size_t largest_frame = 1514;

/// Bytes that a frame of `length` (without check sequence) occupies the wire for: preamble, check sequence and gap included, at
/// least 84 (IEEE 802.3 clause 4.2.3.2, 4.4.2). [any]
constexpr std::size_t wire_bytes(std::size_t length) noexcept { return (length < smallest_frame ? smallest_frame : length) + 24; }

/// A frame that came. `bytes` is valid until the next receive() or wait() on the same port.
struct Arrival {
    std::span<const std::uint8_t> bytes;  ///< from the destination address on, without check sequence
    std::int64_t time_ns = 0;             ///< when it arrived, stamped by the kernel or the segment, on the clock of `now_ns`
};

/// Completes a frame just before it leaves: its number, a check sequence over it. A frame that waited and was dropped has none.
class Finisher {
public:
    virtual ~Finisher() = default;
    /// It leaves now; of its own length, before padding. [realtime] any thread
    virtual void leaves(std::span<std::uint8_t> frame) noexcept = 0;
    /// The newest leaves() of this frame came to nothing: the system did not take it. [realtime] any thread
    virtual void stayed(std::span<const std::uint8_t> frame) noexcept = 0;
};

/// When and how a frame leaves.
struct Launch {
    std::int64_t at_ns = 0;       ///< not before; 0: at once
    std::int64_t guard_ns = 0;    ///< not when it would leave later than this after `at_ns`: it is dropped and counted as late; 0: whenever
    std::uint16_t stamp_at = 0;   ///< place in the frame where 8 bytes, big endian, receive the time of sending; 0: none
    std::int64_t stamp_add_ns = 0;///< added to that time: from the clock of `now_ns` to the one that the receiver expects
    Finisher* finisher = nullptr; ///< outlives the port; nullptr: the frame is complete

    /// A frame of `length` bytes is one, and holds the stamp. [any]
    bool fits(std::size_t length) const noexcept {
        return length >= header_bytes && (stamp_at == 0 || stamp_at + std::size_t{8} <= length);
    }
    /// [any]
    bool is_late(std::int64_t time_ns) const noexcept { return at_ns != 0 && guard_ns > 0 && time_ns > at_ns + guard_ns; }
};

enum class Sent : std::uint8_t {
    queued,  ///< it has left, or will at its time
    full,    ///< no room, or too far ahead for a port without pacer; dropped and counted
    late,    ///< its time and guard had passed; dropped and counted
    down,    ///< no link; dropped and counted
    refused, ///< longer than the segment takes, or shorter than a header; dropped and counted
};
const char* to_string(Sent) noexcept;

struct Statistics {
    bool up = true;               ///< the link has a carrier
    std::uint32_t speed = 0;      ///< Mbit/s; 0: not known
    std::uint32_t mtu = 1500;
    std::uint64_t sent = 0, sent_bytes = 0;
    std::uint64_t received = 0, received_bytes = 0;
    std::uint64_t lost = 0;       ///< frames of others that found no room here, as far as can be known
    std::uint64_t dropped = 0;    ///< own frames that did not leave, late ones apart
    std::uint64_t late = 0;       ///< own frames dropped because their time had passed
    std::uint64_t errors = 0;     ///< frames too short or too long, failed calls
    std::uint64_t downs = 0;      ///< times the link went away
    std::int64_t launch_error_ns = 0;  ///< how much later than asked the newest timed frame left
    std::int64_t departure_ns = 0;     ///< when the newest frame left by the kernel's stamp; 0: it was not asked for, or gives none
};

/// How a port waits in wait().
enum class Policy : std::uint8_t {
    hybrid,  ///< asleep until `spin_ns` before the end, then looking all the time
    block,   ///< asleep until a frame or the end comes
    spin,    ///< looking all the time: for an isolated CPU
};

struct Options {
    std::vector<std::uint16_t> types{};  ///< Ethertypes that are received; empty: all
    Address address{};                   ///< own address on a segment in memory; zeros: one is given. On a real interface: its own
    Policy policy = Policy::hybrid;
    std::int64_t spin_ns = 150'000;
    bool pacer = false;                  ///< a thread of the port launches frames whose time has not come; without it send() waits at
                                         ///< most `spin_ns` for the time and refuses what is further off
    int pacer_priority = 80, pacer_cpu = -1;
    bool transmit_stamps = false;        ///< the kernel stamps what leaves: true times in Statistics, for two system calls a frame
    bool promiscuous = false;            ///< frames to other stations are received too
    std::uint32_t speed = 0;             ///< Mbit/s of a segment in memory; 0: as it is, 100 when it is new
    std::int64_t forward_ns = -1;        ///< in its switch, between its two lines; -1: as it is, 2 us when it is new
    std::int64_t noise_ns = 0;           ///< on it the stamps of this port scatter by that much (sigma), as a kernel's do
    std::size_t send_capacity = 64;
    std::size_t receive_capacity = 256;  ///< frames
};

/// What a port is and what it is capable of.
struct Description {
    std::string address;    ///< as it was opened, without options: equal for all ports that share a line
    std::string transport;  ///< "raw Ethernet", "segment in memory", "capture"
    std::string interface{};
    bool simulated = false; ///< no hardware, time is the runtime's
    std::string remark{};   ///< what it does not have here, in a sentence; empty: nothing
    bool in_memory = false; ///< a segment in memory: a user may choose its own address
    bool paced = false;     ///< Options::pacer gives it a thread that launches frames
};

class Segment;  // link/segment.hpp

/// One user's end of a segment. Opened and destroyed in setup; one thread sends, one receives; they may be two. Nothing here locks
/// or allocates, except what is marked [setup]; nothing waits except wait() and a send() whose time is near.
class Port {
public:
    virtual ~Port() = default;
    Port() = default;
    Port(const Port&) = delete;
    Port& operator=(const Port&) = delete;

    virtual const Address& address() const noexcept = 0;
    /// The frame is whole: destination, source, type, payload; it is copied. [realtime] sender
    virtual Sent send(std::span<const std::uint8_t> frame, const Launch& launch, std::int64_t now_ns) noexcept = 0;
    /// The next frame in order of arrival, or nothing. [realtime] receiver
    virtual std::optional<Arrival> receive(std::int64_t now_ns) noexcept = 0;
    /// Waits by the port's policy until receive() has something or the time has come; true: it has. Not on a segment in memory,
    /// where time does not pass by waiting. [realtime], in a thread or function whose work it is to wait. receiver
    virtual bool wait(std::int64_t until_ns) noexcept = 0;

    virtual Statistics statistics() const noexcept = 0;            ///< [any]
    virtual const Description& description() const noexcept = 0;   ///< [setup]
    /// [setup] A descriptor that polls readable when something may have come, or -1.
    virtual int descriptor() const noexcept { return -1; }
    /// [setup] What can be disturbed on a segment in memory; nullptr on all others.
    virtual Segment* segment() noexcept { return nullptr; }
};

struct Opened {
    std::unique_ptr<Port> port;
    std::string problem;  ///< a sentence: what, why, what to type
    explicit operator bool() const noexcept { return port != nullptr; }
};

/// [setup] Opens `DRIVER:PLACE` or `DRIVER:PLACE?key=value&…`: `speed=100`, `policy=block`, `spin=50us`, `mac=02:00:00:00:00:07`,
/// `pacer`, `priority=80`, `cpu=1`, `promiscuous`, `txstamps`, `sendqueue=64`, `receivequeue=256`, `forward=2us`, `noise=1us`. They win
/// over the options given.
Opened open(std::string_view address, const Options& options = {});
/// [setup] Describes the port that open() would return, as far as the address itself determines it; opens nothing. An unknown driver has an
/// empty `transport`.
Description describe(std::string_view address);

/// "02:00:00:00:00:07", and back; nothing when it is none. [any]
std::string to_string(const Address&);
std::optional<Address> parse_address(std::string_view text) noexcept;

#pragma GCC visibility pop

}  // namespace hal::ethernet
