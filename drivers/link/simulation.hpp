// SPDX-License-Identifier: MIT
// Fault injection on a bus in memory. Everything is repeatable: the same seed and the same times
// give the same faults.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "link/can.hpp"

namespace hal::can {

#pragma GCC visibility push(default)

/// What happens to a frame.
enum class Fault : std::uint8_t {
    error,      ///< destroyed by an error frame; the sender counts the error and sends it again
    loss,       ///< acknowledged by the bus, but not received
    duplicate,  ///< received twice: the sender missed the acknowledgement and repeated it
    delay,      ///< delayed by `delay_ns` in the sender's controller
};

/// Selects the frames that are hit. All conditions must hold.
struct Disturbance {
    Fault fault = Fault::loss;
    std::uint32_t every = 0;      ///< every n-th matching frame; 0: by probability
    double probability = 0.0;     ///< 0..1, drawn per matching frame
    std::uint32_t id = 0;
    std::uint32_t mask = 0;  ///< identifiers that match; mask 0: all
    std::int32_t node = -1;       ///< only frames sent by this node; -1: all
    std::uint64_t count = UINT64_MAX;  ///< ends after this many hits
    std::int64_t delay_ns = 0;
    std::int64_t from_ns = INT64_MIN;
    std::int64_t until_ns = INT64_MAX;  ///< on the bus's clock
};

/// The bus behind a `sim:` link. [setup] unless marked; changes take effect with the next frame.
class Simulation {
public:
    virtual ~Simulation() = default;

    /// Returns the number of this link on its bus.
    virtual int node() const noexcept = 0;
    /// Seeds the random numbers; the bus starts with 1.
    virtual void seed(std::uint64_t) = 0;
    /// Adds a disturbance. Returns its number, or -1 when there are too many.
    virtual int disturb(const Disturbance&) = 0;
    /// Returns how many frames disturbance `number` has hit.
    virtual std::uint64_t hits(int number) const = 0;
    virtual void calm() = 0;  ///< Ends all disturbances, babbling and cuts.
    /// Makes the node send `frame` every `period_ns`, regardless of its identifier's owner; 0 ends
    /// it.
    virtual void babble(const Frame& frame, std::int64_t period_ns) = 0;
    /// Cuts or reconnects the wire of a node: while cut it neither receives nor sends, and is not
    /// acknowledged.
    virtual void cut(int node, bool is_cut) = 0;
    /// Sets error counters as if the errors had happened, to test the consequences.
    virtual void set_counters(int node, unsigned send_errors, unsigned receive_errors) = 0;
    /// Returns the time of the bus: up to when it has been processed. [any]
    virtual std::int64_t time_ns() const noexcept = 0;
};

#pragma GCC visibility pop

}  // namespace hal::can
