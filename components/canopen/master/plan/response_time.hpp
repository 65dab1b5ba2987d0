// SPDX-License-Identifier: MIT
// Worst-case response times of the messages of a CAN bus: from the event that makes a node queue a message to its last bit at the
// receivers. Davis, Burns, Bril, Lukkien: Controller Area Network (CAN) schedulability analysis: refuted, revisited and revised, 2007.
// All of it [setup].
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace hal::canopen::plan {

/// Times in ns; the identifier is the priority.
struct Message {
    std::uint32_t id = 0;
    bool          extended = false, remote = false, fd = false, bit_rate_switch = false;
    std::uint8_t  bytes = 0;
    std::int64_t  period = 0;    ///< shortest time between two of them; above 0
    std::int64_t  deadline = 0;  ///< 0: the period
    std::int64_t  jitter = 0;    ///< how much later than its event it may be queued
    std::int64_t  limit() const noexcept { return deadline > 0 ? deadline : period; }
};

struct Bus {
    std::uint32_t bit_rate = 0;
    std::uint32_t data_rate = 0;  ///< of FD frames with bit-rate switch; 0: the same
};

/// What is known of one message. Indices are those of the list that was analysed.
struct Response {
    unsigned                   bits = 0;              ///< at most, with intermission
    std::int64_t               frame = 0;         ///< their time
    std::int64_t               blocking = 0;      ///< the longest frame of lower importance, which may just have begun
    std::optional<std::size_t> blocker;
    std::int64_t               queued = 0;        ///< longest time in the queue before it starts, from the beginning of the busy time
    std::int64_t               worst = 0;         ///< its worst response time; -1: without limit, the bus is full
    std::int64_t               instance = 0;      ///< the how-manieth of a busy time has it, from 0
    bool                       in_time = false;
};

struct Analysis {
    std::vector<Response> responses;  ///< one for each message, in the order given
    double                load = 0;                  ///< share of the bus's time, 0…
    bool                  fits = false;
};

Analysis analyse(std::span<const Message>, const Bus&);

/// How often message `other` goes first while `late` waits at its worst.
std::int64_t times_before(const Message& other, std::int64_t queued, const Bus&);

/// The message that wins arbitration; equal identifiers have no order.
bool before(const Message&, const Message&) noexcept;

/// The lowest of the customary bit rates (10 kbit/s … 1 Mbit/s) above the given one with which all is in time.
std::optional<std::uint32_t> sufficient_bit_rate(std::span<const Message>, const Bus&);

/// An order of the same messages, first the most important, with which all is in time when they share out their identifiers anew; found
/// if there is one (Audsley). Empty: there is none, or there are more than 256 messages.
std::vector<std::size_t> sufficient_order(std::span<const Message>, const Bus&);

}  // namespace hal::canopen::plan
