// SPDX-License-Identifier: MIT
// What an Ethernet segment in memory is made of and what can go wrong on it, on purpose. Everything is repeatable: the same seed and
// the same times give the same faults.
#pragma once

#include <cstdint>

#include "link/ethernet.hpp"

namespace hal::ethernet {

#pragma GCC visibility push(default)

enum class Fault : std::uint8_t {
    loss,       ///< the receivers do not get it
    duplicate,  ///< comes twice
    delay,      ///< arrives `delay_ns` later; what was sent after it may overtake it
    cut,        ///< only its first `length` bytes arrive
    garble,     ///< one byte, drawn, is another one (a check sequence would have caught it; a hostile station would not)
};

/// Which frames are hit. All conditions must hold.
struct Disturbance {
    Fault fault = Fault::loss;
    std::uint32_t every = 0;         ///< every n-th of those that match; 0: by probability
    double probability = 0.0;
    std::uint16_t type = 0;          ///< Ethertype; 0: all
    std::uint16_t at = 0;            ///< place of 16 bits, big endian, that have to be `is`; 0: nothing is looked at
    std::uint16_t is = 0;
    std::int32_t from = -1, to = -1; ///< ports, by number; -1: all
    std::uint64_t count = UINT64_MAX;///< ends after so many hits
    std::int64_t delay_ns = 0;
    std::size_t length = 0;
    std::int64_t from_ns = INT64_MIN, until_ns = INT64_MAX;  ///< on the segment's clock
};

/// The segment behind a `sim:` port: full-duplex lines to one store-and-forward switch. A frame takes wire_bytes / speed on its
/// sender's line, Options::forward_ns in the switch, and again its wire time on each receiver's line, where it waits its turn.
/// [setup] unless marked; takes effect with the next frame that starts.
class Segment {
public:
    virtual ~Segment() = default;

    virtual int port() const noexcept = 0;  ///< this port's number
    virtual void seed(std::uint64_t) = 0;
    virtual int disturb(const Disturbance&) = 0;         ///< its number, or -1 when there are too many
    virtual std::uint64_t hits(int number) const = 0;
    virtual void calm() = 0;                             ///< ends all disturbances, babbling and cuts
    virtual void babble(int port, std::span<const std::uint8_t> frame, std::int64_t period_ns) = 0;  ///< 0 ends it
    virtual void cut(int port, bool is_cut) = 0;         ///< the cable of a port
    virtual std::int64_t time_ns() const noexcept = 0;   ///< [any]
};

#pragma GCC visibility pop

}  // namespace hal::ethernet
