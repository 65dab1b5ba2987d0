// SPDX-License-Identifier: MIT
// Fault injection on an Ethernet segment in memory. Everything is repeatable: the same seed and the
// same times give the same faults.
#pragma once

#include <cstdint>

#include "link/ethernet.hpp"

namespace hal::ethernet {

#pragma GCC visibility push(default)

/// What happens to a frame.
enum class Fault : std::uint8_t {
    loss,  ///< not received
    duplicate,  ///< received twice
    delay,  ///< arrives `delay_ns` later; later frames may overtake it
    cut,  ///< only its first `length` bytes arrive
    /// one random byte is changed (as by a hostile station: a check sequence would detect a line
    /// error)
    garble,
};

/// Selects the frames that are hit. All conditions must hold.
struct Disturbance {
    Fault fault = Fault::loss;
    std::uint32_t every = 0;  ///< every n-th matching frame; 0: by probability
    double probability = 0.0;
    std::uint16_t type = 0;  ///< Ethertype; 0: all
    /// offset of a 16-bit field, big endian, that must be `is`; 0: not checked
    std::uint16_t at = 0;
    std::uint16_t is = 0;
    std::int32_t from = -1;
    std::int32_t to = -1;  ///< ports, by number; -1: all
    std::uint64_t count = UINT64_MAX;  ///< ends after this many hits
    std::int64_t delay_ns = 0;
    std::size_t length = 0;
    std::int64_t from_ns = INT64_MIN;
    std::int64_t until_ns = INT64_MAX;  ///< on the segment's clock
};

/// A device in line: it answers frames while they arrive, without a thread of its own. A segment
/// with a responder is a cable instead of a switch: a frame takes its wire time once, and a reply
/// may leave while the frame still arrives.
class Responder {
public:
    virtual ~Responder() = default;
    /// Takes a frame whose first bit arrived at `first_bit_ns`; replies by send() of any port, with
    /// Launch::at_ns from `first_bit_ns` on and
    /// `first_bit_ns` as the time. `frame` may be changed; it is valid during the call only.
    /// [realtime] on the thread that works the segment
    virtual void arrived(std::span<std::uint8_t> frame, std::int64_t first_bit_ns) noexcept = 0;
};

/// The segment behind a `sim:` port: full-duplex lines to one store-and-forward switch. A frame
/// takes wire_bytes / speed on its sender's line, Options::forward_ns in the switch, and again its
/// wire time on each receiver's line, where it waits its turn. [setup] unless marked; takes effect
/// with the next frame that starts.
class Segment {
public:
    virtual ~Segment() = default;

    virtual int port() const noexcept = 0;  ///< Returns the number of this port.
    /// Seeds the random numbers; the segment starts with 1.
    virtual void seed(std::uint64_t) = 0;
    /// Adds a disturbance; returns its number, -1 when there are too many.
    virtual int disturb(const Disturbance&) = 0;
    /// Returns how many frames disturbance `number` has hit.
    virtual std::uint64_t hits(int number) const = 0;
    /// Ends all disturbances, babbling and cuts.
    virtual void calm() = 0;
    /// Makes a station send `frame` every `period_ns`; 0 ends it.
    virtual void babble(int port, std::span<const std::uint8_t> frame, std::int64_t period_ns) = 0;
    /// Cuts or reconnects the cable of a port.
    virtual void cut(int port, bool is_cut) = 0;
    virtual std::int64_t time_ns() const noexcept = 0;  ///< Returns the time of the segment. [any]
    /// Lets `responder` take the frames that arrive at this port, instead of receive(), until the
    /// port closes or nullptr is set. When this returns, the previous responder is no longer
    /// called. Returns false if another port of the segment has one.
    virtual bool respond(Responder* responder) = 0;
};

#pragma GCC visibility pop

}  // namespace hal::ethernet
