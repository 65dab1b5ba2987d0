// SPDX-License-Identifier: MIT
// The stations of the segment: the address of each node ID, and the sequence of received frames.
// Nothing is allocated after construction.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <optional>

#include "cane_format.hpp"

namespace hal::can::cane {

using ethernet::Address;

/// Maps node IDs to addresses. Written and read by the receiving thread (learn), read by the
/// sending one (where): entries are atomic words.
class Nodes {
public:
    /// time without a message after which a node may have moved
    static constexpr std::int64_t moved_after_ns = 1'000'000'000;

    /// Fixes the address of a node. [setup]
    void fix(unsigned id, const Address&) noexcept;
    /// Learns from a message with this identifier. Returns false when its node ID is received from
    /// two addresses at the same time; it is reached by broadcast until one of them has sent
    /// nothing for `moved_after_ns`. [realtime] receiver
    bool learn(std::uint32_t id, const Address& from, std::int64_t now_ns) noexcept;
    /// Returns the destination of a message with this 11-bit identifier by the predefined
    /// connection set (CiA 301, 7.3.3); nullopt: all, or unknown. With `produced_to_master`,
    /// messages produced by nodes (TPDO, EMCY, heartbeat) go to the NMT master only. [realtime]
    /// sender
    std::optional<Address> where(std::uint32_t id, bool produced_to_master) const noexcept;

private:
    static constexpr std::uint64_t known = 1ULL << 48;

private:
    static constexpr std::uint64_t fixed = 1ULL << 49;

private:
    static constexpr std::uint64_t doubtful = 1ULL << 50;
    static constexpr unsigned master = 0;  ///< index of the NMT master

    struct Place {
        std::atomic<std::uint64_t> is{0};
        // receiver: last message from there, and from elsewhere
        std::int64_t last_received_ns = 0;
        std::int64_t other_ns = 0;
    };
    bool learn(Place&, const Address&, std::int64_t now_ns) noexcept;

    std::array<Place, 128> places_;
    /// the last client of the node's SDO server
    std::array<std::atomic<std::uint64_t>, 128> asked_{};
};

/// Detects duplicate and lost packed frames, by sender and session.
class Streams {
public:
    struct Verdict {
        bool fresh = true;  ///< false: a duplicate, or out of order
        std::uint32_t lost = 0;  ///< frames missing before it
    };
    /// Takes a received frame. [realtime] receiver
    Verdict take(const Address& from, bool to_all, Stamp, std::int64_t now_ns) noexcept;

private:
    /// sessions, one or two per sender; the least recently used is replaced
    static constexpr unsigned max = 128;
    /// consecutive stale frames after which the sequence restarts
    static constexpr unsigned max_stale = 8;
    struct Sender {
        std::uint64_t key = 0;
        std::int64_t last_received_ns = INT64_MIN;
        struct Stream {
            std::uint16_t last = 0;
            std::uint8_t stale = 0;
            bool begun = false;
        } stream[2];
    };
    std::array<Sender, max> senders_;
};

/// Counts the frames to each destination. Several threads send frames.
class Sequences {
public:
    /// Returns the next number. [realtime] any thread
    std::uint16_t next(const Address& to) noexcept;
    /// Returns an unused number. [realtime] any thread
    void give_back(const Address& to) noexcept;
    void clear() noexcept;  ///< Resets all numbers. [setup]

private:
    static constexpr std::uint64_t nobody = ~0ULL;
    struct Counter {
        std::atomic<std::uint64_t> key{nobody};
        std::atomic<std::uint16_t> count{0};
    };
    std::atomic<std::uint16_t>& of(const Address& to) noexcept;
    // broadcast, 127 nodes, and some that moved; the last one is shared by the rest
    std::array<Counter, 256> counters_;
};

}  // namespace hal::can::cane
