// SPDX-License-Identifier: MIT
// The seam to every CAN bus: frames, send, receive, filters, state of the controller, statistics.
// An address picks the driver. Code above this header does not know the kind of bus; this header
// does not know the protocol of the frames.
//
//     auto opened = hal::can::open("can:can0");               // [setup]
//     if (!opened) throw std::runtime_error(opened.problem);  // one sentence: what, why, what to type
//     ...
//     hal::can::Frame frame;                                  // in the cycle; now_ns is the start of the cycle
//     while (link.receive(frame, now_ns)) take(frame);
//     link.send({0x181, {1, 2, 3}}, now_ns);
//     link.flush(now_ns);                                     // the frames of the cycle leave with one system call
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

/// Value of `now_ns` for threads without a cycle, which do not know the runtime's time. The link
/// uses the newest time it knows.
inline constexpr std::int64_t unclocked = INT64_MIN;

/// One frame, classic or FD. Frames made by a user may be invalid: valid() checks them, and send()
/// rejects invalid ones.
struct Frame {
    std::uint32_t id = 0;  ///< 11 bits, or 29 when `extended`; no flags inside
    /// bytes of data: 0..8; FD: 0..8, 12, 16, 20, 24, 32, 48, 64. Remote frame: the requested
    /// length
    std::uint8_t length = 0;
    bool extended = false;  ///< 29-bit identifier
    bool remote = false;  ///< remote frame: a request without data; classic only
    bool fd = false;  ///< CAN FD
    bool bit_rate_switch = false;  ///< FD: data phase at the data rate
    bool error_state = false;  ///< FD: the sender is error passive
    /// error frame: an event of the controller; `id` holds bits of ErrorClass. Only with
    /// Options::error_frames
    bool error = false;
    /// received: sent by this link itself. Only with Options::own_frames
    bool own = false;
    /// received: time of its last bit in ns, on the clock of `now_ns`; 0: the system gave none
    std::int64_t time_ns = 0;
    alignas(8) std::array<std::uint8_t, 64> data{};

    Frame() = default;
    /// Makes a data frame; extended when the identifier is above 7FFh, FD when there are more than
    /// 8 bytes. [any]
    Frame(std::uint32_t identifier, std::initializer_list<std::uint8_t> bytes) noexcept
        : Frame(identifier, std::span(bytes.begin(), bytes.size())) {}
    Frame(std::uint32_t identifier, std::span<const std::uint8_t> bytes) noexcept
        : id(identifier), extended(identifier > 0x7ff) {
        length = static_cast<std::uint8_t>(bytes.size() < 64 ? bytes.size() : 64);
        fd = length > 8;
        if (length != 0) {
            std::memcpy(data.data(), bytes.data(), length);
        }
    }
    /// Makes a remote frame. [any]
    static Frame request(std::uint32_t identifier, std::uint8_t wanted) noexcept {
        Frame f;
        f.id = identifier;
        f.extended = identifier > 0x7ff;
        f.remote = true;
        f.length = wanted;
        return f;
    }
    /// Returns the data; empty for a remote frame. [any]
    std::span<const std::uint8_t> bytes() const noexcept {
        if (remote) return {};
        return {data.data(), length < 64 ? length : std::size_t{64}};
    }

    /// Returns true for a classic frame with an 11-bit identifier, the kind that CANopen and SCoCAN
    /// use. [any]
    bool is_standard() const noexcept { return !extended && !fd && !error; }
    /// Returns true for a data frame of that kind. [any]
    bool is_standard_data() const noexcept { return is_standard() && !remote; }
    /// Returns true for a frame that a controller can send (ISO 11898-1). [any]
    bool valid() const noexcept;
    /// Returns true when the frames are equal on the bus; times and flags of origin are ignored.
    /// [any]
    bool same(const Frame& other) const noexcept;
};

/// Bits of `Frame::id` of an error frame; the values are those of the Linux kernel.
enum ErrorClass : std::uint32_t {
    error_send_timeout = 0x001,
    error_lost_arbitration = 0x002,
    /// data[1]: details; data[6], data[7]: transmit and receive error counters
    error_controller = 0x004,
    error_protocol = 0x008,
    error_transceiver = 0x010,
    error_no_acknowledge = 0x020,
    error_bus_off = 0x040,
    error_bus = 0x080,
    error_restarted = 0x100,
};

/// Convert between FD length codes 0..15 and bytes; the code is the smallest that holds the bytes.
/// [any]
std::uint8_t length_of_code(unsigned code) noexcept;
std::uint8_t code_of_length(std::size_t length) noexcept;

/// A filter that passes frames of one kind with (frame id & mask) == (id & mask). A link without
/// filters passes everything.
struct Filter {
    std::uint32_t id = 0;
    std::uint32_t mask = 0;
    bool extended = false;
    bool matches(const Frame& f) const noexcept {
        return f.extended == extended && ((f.id ^ id) & mask) == 0;
    }
};

/// State of the controller (ISO 11898-1 fault confinement).
enum class State : std::uint8_t {
    active,  ///< error active
    warning,  ///< an error counter reached 96
    passive,  ///< an error counter reached 128: the node no longer destroys the frames of others
    bus_off,  ///< the transmit error counter exceeded 255: the node is off the bus
    /// the interface is down, unplugged, or the peer is lost; the driver keeps trying to recover
    down,
};
/// Returns "active", "warning", "passive", "bus off" or "down". [any]
const char* to_string(State) noexcept;

/// Result of send().
enum class Sent : std::uint8_t {
    queued,  ///< will be sent in its turn
    full,  ///< dropped and counted: the transmit queue is full
    bus_off,  ///< dropped and counted: bus off
    down,  ///< dropped and counted: bus down
    /// dropped and counted: invalid frame, FD frame on a classic bus, or listen-only link
    rejected,
};
/// Returns "queued", "full", "bus off", "down" or "rejected". [any]
const char* to_string(Sent) noexcept;

/// When a frame may start: the transmit-enable window of a time-triggered controller (TTCAN, ISO
/// 11898-4). Times on the clock of `now_ns`.
struct Window {
    std::int64_t not_before_ns = 0;
    std::int64_t last_start_ns = INT64_MAX;  ///< discarded if it has not started by then
    /// discarded if a frame started in [from, until); equal times: no condition
    std::int64_t idle_from_ns = 0;
    std::int64_t idle_until_ns = 0;
    bool single_shot = false;  ///< discarded after an error, instead of being repeated
};

/// Statistics of a link; counts start at open().
struct Statistics {
    State state = State::active;
    std::uint8_t send_errors = 0;  ///< transmit error counter, at most 255
    std::uint8_t receive_errors = 0;  ///< receive error counter
    std::uint64_t sent = 0;  ///< frames sent (acknowledged, where the driver knows)
    std::uint64_t sent_bytes = 0;  ///< data bytes of these frames
    std::uint64_t received = 0;
    std::uint64_t received_bytes = 0;
    std::uint64_t lost = 0;  ///< frames of others lost here or in transit, as far as known
    /// of these: lost in transit (where frames have sequence numbers)
    std::uint64_t lost_on_wire = 0;
    /// frames of others whose sender is not allowed to send them (where the driver knows senders)
    std::uint64_t rejected = 0;
    std::uint64_t dropped = 0;  ///< own frames not queued, or discarded
    std::uint64_t errors = 0;  ///< error frames, malformed datagrams or lines
    std::uint64_t bus_offs = 0;
    std::uint64_t restarts = 0;  ///< recoveries from bus off or from a lost interface
    std::uint32_t queued = 0;  ///< own frames waiting
    double load = 0.0;  ///< bus load 0..1 over the last 0.1 s; 0 without a known bit rate
};

/// Bit rate of a bus in memory without timing: frames arrive in the call that sends them.
inline constexpr std::uint32_t unlimited = UINT32_MAX;

/// Options of open(); options in the address take precedence.
struct Options {
    /// bit/s; 0: as the bus is set up, or the driver's default; `sim:` also accepts `unlimited`
    std::uint32_t bit_rate = 0;
    std::uint32_t data_rate = 0;  ///< bit/s of the FD data phase
    bool fd = false;  ///< CAN FD frames are sent and received
    bool own_frames = false;  ///< own frames are received once sent, with `own` set
    bool error_frames = false;  ///< error frames are received
    bool listen_only = false;
    /// SocketCAN: kernel timestamps, and a count of frames the kernel dropped; costs time per frame
    bool stamps = false;
    /// delay of the automatic restart after bus off, ms; 0: only by restart()
    std::uint32_t restart_ms = 100;
    std::size_t send_capacity = 512;  ///< frames
    std::size_t receive_capacity = 2048;  ///< frames
};

/// Frames that their sender is not allowed to send, and that were not passed on.
struct Rejected {
    enum class Why : std::uint8_t {
        not_the_master,
        unknown_station,
        out_of_slot,
        unsigned_frame,
        wrong_tag,
        replayed
    };
    Why why = Why::not_the_master;
    std::uint32_t id = 0;  ///< of the first frame, where readable
    std::uint64_t from = 0;  ///< address of the sender, 48 bits
    std::uint32_t count = 0;  ///< frames of this sender since the last report
};
/// Returns a log message. [setup]
std::string to_string(const Rejected&);

/// Description of a link and its capabilities. Valid as long as the link.
struct Description {
    std::string address;  ///< as opened, with defaults filled in
    std::string transport;  ///< "SocketCAN", "bus in memory", …
    std::uint32_t bit_rate = 0;
    std::uint32_t data_rate = 0;  ///< bit/s; 0: unknown
    bool fd = false;
    bool simulated = false;  ///< true: no hardware, time is the runtime's
    bool in_memory = false;  ///< a bus in memory: its first user sets the bit rate
    /// frames share the time of one bus; false: carried in Ethernet frames
    bool has_bit_rate = true;
    /// Options::stamps gives received frames the timestamp of the kernel or of the bus
    bool has_stamps = false;
    /// Options::own_frames returns a frame once it has been on the bus, so that another node has
    /// acknowledged it; false: it has none, or returns it when the driver has accepted it
    bool has_echo = false;
    bool listen_only = false;  ///< send() rejects all frames, or the controller drops them
    bool has_windows = false;  ///< send() within a Window works
    /// Options::fd fails on a device without CAN FD: set it only when the user requests it
    bool fd_on_request = false;
    bool in_slots = false;  ///< frames leave in their time slots, however early they are sent
    std::string interface{};  ///< of the kernel, "can0"; empty: none
    /// address of the Ethernet segment that carries the frames; empty: none
    std::string segment{};
    std::string file{};  ///< of a capture; empty: none
};

/// Time that values take between this station and another one, where known in advance. Cycles are
/// those of this station, counted from the one in which a value is written or read here.
struct DeliveryTime {
    std::string station;  ///< the other station
    /// from the start of the cycle that writes a value to its use by the other station
    std::int64_t there_ns = 0;
    /// worst case from the change of an input there to the cycle that receives it
    std::int64_t back_ns = 0;
    std::uint32_t there_cycles = 0;
    std::uint32_t back_cycles = 0;
    /// cycles from a value here to an input there that depends on it, and back
    std::uint32_t round_trip = 0;
};

class Simulation;  // link/simulation.hpp

/// One user's end of a bus. Opened and destroyed in setup. One thread at a time sends and flushes,
/// one thread at a time receives; they may be different threads. For more users open the address
/// again: that is another node on the same bus. No function waits, locks or allocates, except those
/// marked [setup].
class Link {
public:
    virtual ~Link() = default;
    Link() = default;
    Link(const Link&) = delete;
    Link& operator=(const Link&) = delete;

    /// Queues a frame. It leaves at flush(), or earlier if the queue is full. [realtime] sender
    virtual Sent send(const Frame&, std::int64_t now_ns) noexcept = 0;
    /// Queues a frame that starts in a window, behind those queued before. What became of it is
    /// known by its echo (Options::own_frames): a discarded frame has none. Only with
    /// Description::has_windows. [realtime] sender
    virtual Sent send_within(const Frame&, const Window&, std::int64_t /*now_ns*/) noexcept {
        return Sent::rejected;
    }
    /// Sends queued frames as far as the bus takes them; the rest stays for the next call. Call it
    /// once per cycle. [realtime] sender
    virtual void flush(std::int64_t now_ns) noexcept = 0;
    /// Drops own frames that have not left for the controller: behind them, others would be late.
    /// Without effect where the frames of this link are on the bus already, or in its schedule.
    /// [realtime] sender
    virtual void discard_queued() noexcept {}
    /// Frames that leave from now on overtake those of other programs that wait in the queue of the
    /// interface. Returns false where there is no such queue. [realtime] sender
    virtual bool set_urgent(bool) noexcept { return false; }
    /// Receives the next frames in order of time. Returns how many; 0: none by now. [realtime]
    /// receiver
    virtual std::size_t receive(std::span<Frame> frames, std::int64_t now_ns) noexcept = 0;
    /// Receives the next frame. Returns false: none by now. [realtime] receiver
    bool receive(Frame& frame, std::int64_t now_ns) noexcept {
        return receive(std::span(&frame, 1), now_ns) == 1;
    }

    /// Returns the statistics; each value is exact, but they are not of the same instant. [any]
    virtual Statistics statistics() const noexcept = 0;
    /// Returns the state of the controller. [any]
    virtual State state() const noexcept = 0;
    /// Ends bus off now instead of after `restart_ms`. [realtime] sender
    virtual void restart() noexcept {}

    /// Replaces all filters; empty passes everything. Returns false when the driver supports fewer.
    /// [setup]
    virtual bool set_filters(std::span<const Filter>) = 0;
    /// Returns the description of the link. [setup]
    virtual const Description& description() const noexcept = 0;
    /// Returns the delivery times to each other station; empty: unknown. [setup]
    virtual std::vector<DeliveryTime> delivery_times() const { return {}; }
    /// Waits at most `at_most_ns` until receive() has a frame. Returns true when it has. For
    /// threads without a cycle. [setup]
    virtual bool wait(std::int64_t at_most_ns) = 0;
    /// Returns how long the destructor may wait until what is queued is sent, ns. [setup]
    virtual std::int64_t closing_ns() const noexcept { return 0; }
    /// Returns a descriptor that polls readable when a frame may have arrived, or -1. [any]
    virtual int descriptor() const noexcept { return -1; }
    /// Returns the fault injection of a bus in memory; nullptr on all others. [setup]
    virtual Simulation* simulation() noexcept { return nullptr; }
    /// Takes a report of frames rejected since the last call, at most one sender per second.
    /// Returns false: none. [realtime] receiver
    virtual bool rejected(Rejected&) noexcept { return false; }
};

/// Why a component needs closing_ns() to stop.
inline constexpr const char* closing_text = "a slow bus still sends what is queued";

/// A link, or in `problem` a sentence with place, cause and what to type.
struct Opened {
    std::unique_ptr<Link> link;
    std::string problem;
    explicit operator bool() const noexcept { return link != nullptr; }
};

/// Opens `DRIVER:PLACE` or `DRIVER:PLACE?key=value&key=value`. Keys are those of Options
/// (`bitrate=500000` or `500k`,
/// `datarate=2M`, `fd`, `listen`, `restart=MS`) and take precedence over them. [setup]
Opened open(std::string_view address, const Options& options = {});
/// Describes the link that open() would return, as far as the address determines it, without
/// opening it. `transport` is empty for an unknown driver. [setup]
Description describe(std::string_view address);

#pragma GCC visibility pop

}  // namespace hal::can
