// SPDX-License-Identifier: MIT
// Worst-case response times of the messages of a CAN bus: from the event that makes a node queue a
// message to the end of the intermission behind it, when all receivers have it and the bus is free
// again.
//
//     std::vector<Message> messages = {{.id = 0x100, .bytes = 8, .period = 10'000'000}, ...};
//     const Analysis a = analyse(messages, {.bit_rate = 500'000});
//     if (!a.responses[0].in_time) ...
//
// Sources: Davis, Burns, Bril, Lukkien: Controller Area Network (CAN) schedulability analysis:
// refuted, revisited and revised, 2007; queues in order of arrival: Davis, Kollmann, Pollex,
// Slomka: Controller Area Network (CAN) schedulability analysis with FIFO queues, 2011. Everything
// here is [setup].
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace hal::can_timing {

/// A message that is sent again and again. Times in ns; the identifier is the priority.
struct Message {
    std::uint32_t id = 0;
    bool extended = false;
    bool remote = false;
    bool fd = false;
    bool bit_rate_switch = false;
    std::uint8_t bytes = 0;
    std::int64_t period = 0;  ///< shortest time between two events; above 0
    std::int64_t deadline = 0;  ///< 0: the period
    std::int64_t jitter = 0;  ///< longest time from its event until it is queued
    /// Its node sends messages of the same number in the order in which they were queued (one
    /// transmit buffer, or a network interface of Linux with several senders); 0: the node always
    /// offers its most urgent message.
    std::uint32_t fifo = 0;
    /// length with stuff bits and intermission, if it is known to be constant; 0: the longest of
    /// its shape
    std::uint32_t bits = 0;
    std::int64_t limit() const noexcept { return deadline > 0 ? deadline : period; }
};

/// Frames that are destroyed by errors and sent again: at most `burst` at once, and one more in
/// every `period`.
struct Errors {
    std::uint32_t burst = 0;  ///< 0: no errors
    std::int64_t period = 0;  ///< ns; 0: none after the burst
};

struct Bus {
    std::uint32_t bit_rate = 0;  ///< bit/s
    std::uint32_t data_rate = 0;  ///< bit/s of FD frames with bit-rate switch; 0: the same
    Errors errors = {};
};

/// What is known of one message. Times in ns; indices are those of the list that was analysed.
struct Response {
    unsigned bits = 0;  ///< at most, with intermission
    std::int64_t frame = 0;  ///< their time
    /// longest frame of lower priority, or of its own queue, that may just have begun
    std::int64_t blocking = 0;
    std::optional<std::size_t> blocker;
    std::int64_t errors = 0;  ///< time that errors take while it waits and is sent
    /// of a queue in order of arrival: time for the other messages in it
    std::int64_t queue = 0;
    /// longest time from the beginning of the busy period until it starts
    std::int64_t queued = 0;
    /// worst response time; -1: none, the bus is overloaded for it
    std::int64_t worst = 0;
    /// number of the instance in the busy period that has it, from 0
    std::int64_t instance = 0;
    bool in_time = false;
};

struct Analysis {
    std::vector<Response> responses;  ///< one for each message, in the order given
    double load = 0;  ///< share of the time of the bus, 0 and more; without errors
    bool fits = false;  ///< each message meets its deadline
};

/// Computes the response times. A message of a FIFO queue must be sent before the next one of its
/// kind is queued: otherwise it is reported as late. The result is exact without FIFO queues and
/// errors, and an upper bound with them.
Analysis analyse(std::span<const Message>, const Bus&);

/// Returns how many instances of `other` are sent while a message waits for `queued`.
std::int64_t times_before(const Message& other, std::int64_t queued, const Bus&);

/// Returns whether `a` wins arbitration against `b`; equal identifiers have no order.
bool before(const Message& a, const Message& b) noexcept;

/// Returns the lowest of the customary bit rates (10 kbit/s to 1 Mbit/s) above the given one with
/// which each message meets its deadline.
std::optional<std::uint32_t> sufficient_bit_rate(std::span<const Message>, const Bus&);

/// Returns an order of the messages, highest priority first, with which each of them meets its
/// deadline if the identifiers are assigned in this order; it is found if there is one (Audsley).
/// Empty if none is found, and for more than 256 messages or a FIFO queue.
std::vector<std::size_t> sufficient_order(std::span<const Message>, const Bus&);

}  // namespace hal::can_timing
