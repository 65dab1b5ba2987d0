// SPDX-License-Identifier: MIT
// What can go wrong on a bus in memory, on purpose. Everything is repeatable: the same seed and the same times give the same faults.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "link/can.hpp"

namespace hal::can {

#pragma GCC visibility push(default)

/// What happens to a frame.
enum class Fault : std::uint8_t {
    error,      ///< destroyed by an error frame; the sender counts and sends it again
    loss,       ///< acknowledged by the bus, but the receivers do not get it
    duplicate,  ///< comes twice: the sender missed the acknowledgement and repeated it
    delay,      ///< the sender's controller holds it back for `delay_ns`
};

/// Which frames are hit. All conditions must hold.
struct Disturbance {
    Fault fault = Fault::loss;
    std::uint32_t every = 0;      ///< every n-th of those that match; 0: by probability
    double probability = 0.0;     ///< 0..1, drawn per matching frame
    std::uint32_t id = 0, mask = 0;  ///< identifiers that match; mask 0: all
    std::int32_t node = -1;       ///< only frames sent by this node; -1: all
    std::uint64_t count = UINT64_MAX;  ///< ends after so many hits
    std::int64_t delay_ns = 0;
    std::int64_t from_ns = INT64_MIN, until_ns = INT64_MAX;  ///< on the bus's clock
};

/// The bus behind a `sim:` link. [setup] unless marked; takes effect with the next frame that starts.
class Simulation {
public:
    virtual ~Simulation() = default;

    /// This link's number on its bus.
    virtual int node() const noexcept = 0;
    /// Seed of everything drawn; the bus starts with 1.
    virtual void seed(std::uint64_t) = 0;
    /// Adds a disturbance; its number, or -1 when there are too many.
    virtual int disturb(const Disturbance&) = 0;
    /// How many frames disturbance `number` has hit.
    virtual std::uint64_t hits(int number) const = 0;
    virtual void calm() = 0;  ///< ends all disturbances, babbling and cuts
    /// The node sends `frame` every `period_ns` for ever, whoever it belongs to; 0 ends it.
    virtual void babble(const Frame& frame, std::int64_t period_ns) = 0;
    /// Cuts (or joins) the wire of a node: it neither hears nor is heard, and nobody acknowledges it.
    virtual void cut(int node, bool is_cut) = 0;
    /// Sets error counters as if the errors had happened: tests of what follows from them.
    virtual void set_counters(int node, unsigned send_errors, unsigned receive_errors) = 0;
    /// The bus's time: until when it has been worked out. [any]
    virtual std::int64_t time_ns() const noexcept = 0;
};

#pragma GCC visibility pop

}  // namespace hal::can
