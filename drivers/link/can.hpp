// SPDX-License-Identifier: MIT
// The seam to every CAN bus: frames, send, receive, filters, state of the controller, statistics. An address picks the driver.
// Nothing above this header knows which bus it talks to; nothing in it knows which protocol the frames carry.
//
//     auto opened = hal::can::open("can:can0");               // [setup]
//     if (!opened) throw std::runtime_error(opened.problem);  // one sentence: what, why, what to type
//     ...
//     hal::can::Frame frame;                                  // in the cycle; now_ns is the start of the cycle
//     while (link.receive(frame, now_ns)) take(frame);
//     link.send({0x181, {1, 2, 3}}, now_ns);
//     link.flush(now_ns);                                     // what the cycle sent leaves with one system call
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <initializer_list>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace hal::can {

#pragma GCC visibility push(default)

/// "I have no cycle": as `now_ns`, for threads that do not know the runtime's time. The link takes the newest time it was told.
inline constexpr std::int64_t unclocked = INT64_MIN;

/// One frame, classic or FD. The fields may hold nonsense when they come from a user: `valid()` says, and send() refuses what is not.
struct Frame {
    std::uint32_t id = 0;      ///< 11 bits, or 29 when `extended`; no flags inside
    std::uint8_t length = 0;   ///< bytes of data: 0..8; FD: 0..8, 12, 16, 20, 24, 32, 48, 64. Of a remote frame: the length asked for
    bool extended = false;     ///< 29-bit identifier
    bool remote = false;       ///< a request without data; classic only
    bool fd = false;           ///< CAN FD
    bool bit_rate_switch = false;  ///< FD: data phase at the data rate
    bool error_state = false;      ///< FD: the sender is error passive
    bool error = false;        ///< not a frame but an event of the controller: see ErrorClass; `id` holds its bits. Only on request
    bool own = false;          ///< received: one of this link's own, now on the bus. Only on request
    std::int64_t time_ns = 0;  ///< received: when its last bit was seen, on the clock of `now_ns`
    alignas(8) std::array<std::uint8_t, 64> data{};

    Frame() = default;
    Frame(std::uint32_t identifier, std::initializer_list<std::uint8_t> bytes) noexcept
        : Frame(identifier, std::span(bytes.begin(), bytes.size())) {}
    Frame(std::uint32_t identifier, std::span<const std::uint8_t> bytes) noexcept : id(identifier), extended(identifier > 0x7ff) {
        length = static_cast<std::uint8_t>(bytes.size() < 64 ? bytes.size() : 64);
        fd = length > 8;
        if (length != 0) std::memcpy(data.data(), bytes.data(), length);
    }
    static Frame request(std::uint32_t identifier, std::uint8_t wanted) noexcept {
        Frame f;
        f.id = identifier, f.extended = identifier > 0x7ff, f.remote = true, f.length = wanted;
        return f;
    }
    std::span<const std::uint8_t> bytes() const noexcept {
        return {data.data(), remote ? std::size_t{0} : length < 64 ? length : std::size_t{64}};
    }

    /// What a controller could put on a bus. [any]
    bool valid() const noexcept;
    /// Equal as the bus sees it: time and origin do not count. [any]
    bool same(const Frame& other) const noexcept;
};

/// Bits of `Frame::id` of an error frame; the same numbers as the kernel's.
enum ErrorClass : std::uint32_t {
    error_send_timeout = 0x001,
    error_lost_arbitration = 0x002,
    error_controller = 0x004,  ///< data[1]: what; data[6], data[7]: send and receive error counters
    error_protocol = 0x008,
    error_transceiver = 0x010,
    error_no_acknowledge = 0x020,
    error_bus_off = 0x040,
    error_bus = 0x080,
    error_restarted = 0x100,
};

/// FD lengths: code 0..15 to bytes, and bytes to the smallest code that holds them. [any]
std::uint8_t length_of_code(unsigned code) noexcept;
std::uint8_t code_of_length(std::size_t length) noexcept;

/// Passes frames of one kind whose (id & mask) == (this id & mask). A link without filters passes everything.
struct Filter {
    std::uint32_t id = 0;
    std::uint32_t mask = 0;
    bool extended = false;
    bool matches(const Frame& f) const noexcept { return f.extended == extended && ((f.id ^ id) & mask) == 0; }
};

enum class State : std::uint8_t {
    active,   ///< in order
    warning,  ///< an error counter reached 96
    passive,  ///< an error counter reached 128: the node no longer destroys the frames of others
    bus_off,  ///< the send error counter passed 255: the node no longer takes part
    down,     ///< the interface is down, unplugged, or the peer has gone; the driver keeps trying to come back
};
/// "active", "warning", "passive", "bus off", "down". [any]
const char* to_string(State) noexcept;

enum class Sent : std::uint8_t {
    queued,   ///< it will be sent in its turn
    full,     ///< no room: the bus takes less than is sent; the frame is dropped and counted
    bus_off,  ///< dropped and counted: bus off
    down,     ///< dropped and counted: no bus
    refused,  ///< dropped and counted: not a valid frame, or FD on a bus without, or the link only listens
};
const char* to_string(Sent) noexcept;

/// Counts since open.
struct Statistics {
    State state = State::active;
    std::uint8_t send_errors = 0;     ///< TEC; 255 also when more
    std::uint8_t receive_errors = 0;  ///< REC
    std::uint64_t sent = 0;           ///< frames given to the bus (where the driver learns it: acknowledged)
    std::uint64_t sent_bytes = 0;     ///< their data
    std::uint64_t received = 0;
    std::uint64_t received_bytes = 0;
    std::uint64_t lost = 0;       ///< frames of others that did not find room here, or were lost on the way, as far as can be known
    std::uint64_t lost_on_wire = 0;  ///< of them: those that left their sender and did not come (where frames have numbers)
    std::uint64_t rejected = 0;   ///< frames of others that their sender may not send (where the driver knows senders)
    std::uint64_t dropped = 0;    ///< own frames that were not queued or were thrown away
    std::uint64_t errors = 0;     ///< error frames, malformed datagrams or lines
    std::uint64_t bus_offs = 0;
    std::uint64_t restarts = 0;   ///< back after bus off or after the interface was away
    std::uint32_t queued = 0;     ///< own frames waiting
    double load = 0.0;            ///< share of the bus's time in use, 0..1, over the last tenth of a second; 0 when no bit rate is known
};

/// As a bit rate of a bus in memory: frames take no time and arrive in the call that sends them.
inline constexpr std::uint32_t unlimited = UINT32_MAX;

struct Options {
    std::uint32_t bit_rate = 0;   ///< bit/s; 0: as the bus is set up, or the driver's default; `sim:` also takes `unlimited`
    std::uint32_t data_rate = 0;  ///< bit/s of the FD data phase
    bool fd = false;              ///< CAN FD frames are sent and received
    bool own_frames = false;      ///< own frames come back when they were on the bus, with `own` set
    bool error_frames = false;    ///< error frames are received
    bool listen_only = false;
    bool stamps = false;          ///< SocketCAN: the kernel's time of each frame, and a count of those it dropped; each frame costs more
    std::uint32_t restart_ms = 100;  ///< wait after bus off before the link returns by itself; 0: only by restart()
    std::size_t send_capacity = 512;
    std::size_t receive_capacity = 2048;
};

/// Frames of a sender that it may not send, and that were not passed on.
struct Rejected {
    enum class Why : std::uint8_t { not_the_master, stranger, out_of_slot, unsigned_frame, wrong_tag, replayed };
    Why why = Why::not_the_master;
    std::uint32_t id = 0;    ///< of the first; where it could be read
    std::uint64_t from = 0;  ///< address of the sender, 48 bits
    std::uint32_t count = 0; ///< of this sender since the last report
};
/// A sentence for a log. [setup]
std::string to_string(const Rejected&);

/// What a link is and what it is capable of. Valid as long as the link.
struct Description {
    std::string address;    ///< as it was opened, completed
    std::string transport;  ///< "SocketCAN", "bus in memory", …
    std::uint32_t bit_rate = 0, data_rate = 0;  ///< 0: not known
    bool fd = false;
    bool simulated = false;       ///< true: no hardware, time is the runtime's
    bool in_memory = false;       ///< a bus in memory: it takes its bit rate from who opens it first
    bool has_bit_rate = true;     ///< frames share the time of one bus; false: Ethernet carries them
    bool has_stamps = false;      ///< Options::stamps gives received frames the time of the kernel or of the bus
    bool fd_on_request = false;   ///< a device without CAN FD rejects Options::fd: only set it when the user asks for it
    std::string interface{};      ///< of the kernel, "can0"; empty: none
    std::string segment{};        ///< address of the Ethernet segment that carries the frames; empty: none
    std::string file{};           ///< of a capture; empty: none
};

/// How long values take between this station and another, where that is known beforehand. Cycles are this station's, counted from the one
/// in which a value is written or read here.
struct DeliveryTime {
    std::string station;          ///< the other one
    std::int64_t there_ns = 0;    ///< from the beginning of the cycle that writes a value to the moment when the other one takes it
    std::int64_t back_ns = 0;     ///< from the change of an input there, just after it was read, to the cycle that has it
    std::uint32_t there_cycles = 0, back_cycles = 0;
    std::uint32_t round_trip = 0; ///< cycles from a value here to an input there that follows it, and back
};

class Simulation;  // link/simulation.hpp

/// One user's end of a bus. Opened and destroyed in setup. One thread at a time sends and flushes, one thread at a time
/// receives; they may be two. Whoever needs more opens the address again: that is another node on the same bus.
/// Nothing here waits, locks or allocates, except what is marked [setup].
class Link {
public:
    virtual ~Link() = default;
    Link() = default;
    Link(const Link&) = delete;
    Link& operator=(const Link&) = delete;

    /// Queues a frame. It leaves at flush(), at the latest when the queue has no more room. [realtime] sender
    virtual Sent send(const Frame&, std::int64_t now_ns) noexcept = 0;
    /// Hands what is queued to the bus, as far as it takes it; the rest stays for the next call. Once a cycle. [realtime] sender
    virtual void flush(std::int64_t now_ns) noexcept = 0;
    /// The next frames in order of their time, up to the room given; how many. 0: none by now. [realtime] receiver
    virtual std::size_t receive(std::span<Frame> room, std::int64_t now_ns) noexcept = 0;
    /// The next frame; false: none by now. [realtime] receiver
    bool receive(Frame& frame, std::int64_t now_ns) noexcept { return receive(std::span(&frame, 1), now_ns) == 1; }

    /// [any] Numbers that are each right, though not all of the same instant.
    virtual Statistics statistics() const noexcept = 0;
    /// [any]
    virtual State state() const noexcept = 0;
    /// [realtime] sender. Ends a bus-off now instead of after `restart_ms`.
    virtual void restart() noexcept {}

    /// [setup] Replaces all filters; empty: everything passes. False when there are more than the driver can hold.
    virtual bool set_filters(std::span<const Filter>) = 0;
    /// [setup]
    virtual const Description& description() const noexcept = 0;
    /// [setup] Returns how long values take to each other station; empty: not known.
    virtual std::vector<DeliveryTime> delivery_times() const { return {}; }
    /// [setup] Waits until receive() has something to give or the time is over. For threads without a cycle. True: there is something.
    virtual bool wait(std::int64_t at_most_ns) = 0;
    /// [any] A descriptor that polls readable when something may have come, or -1.
    virtual int descriptor() const noexcept { return -1; }
    /// [setup] What can be disturbed on a bus in memory; nullptr on all others.
    virtual Simulation* simulation() noexcept { return nullptr; }
    /// [realtime] receiver. What was rejected since the last call; at most one sender a second. False: nothing.
    virtual bool rejected(Rejected&) noexcept { return false; }
};

/// A link, or why there is none: a sentence with place, cause and what to type.
struct Opened {
    std::unique_ptr<Link> link;
    std::string problem;
    explicit operator bool() const noexcept { return link != nullptr; }
};

/// [setup] Opens `DRIVER:PLACE` or `DRIVER:PLACE?key=value&key=value`. Keys are those of Options (`bitrate=500000` or `500k`,
/// `datarate=2M`, `fd`, `listen`, `restart=MS`) and win over them. Drivers: can, sim, udp, slcan, cane, replay.
Opened open(std::string_view address, const Options& options = {});
/// [setup] Describes the link that open() would return, as far as the address itself determines it; opens nothing. An unknown driver has an
/// empty `transport`.
Description describe(std::string_view address);

#pragma GCC visibility pop

}  // namespace hal::can
