// SPDX-License-Identifier: MIT
// Who is on the segment: where each node-id lives, and which frames of whom have come already. No memory is taken after construction.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <optional>

#include "cane_format.hpp"

namespace hal::can::cane {

using ethernet::Address;

/// Node-id to address. Written and read by the receiving thread (learn), read by the sending one (where): entries are single atomic words.
class Nodes {
public:
    static constexpr std::int64_t moved_after_ns = 1'000'000'000;  ///< silence after which a node may be at another address

    /// It stays there, whatever comes. [setup]
    void fix(unsigned id, const Address&) noexcept;
    /// A message with this identifier came from there. False: its node-id is heard from two addresses at the same time; it is reached by
    /// broadcast until one is silent for `moved_after_ns`. [realtime] receiver
    bool learn(std::uint32_t id, const Address& from, std::int64_t now_ns) noexcept;
    /// Where a message with this 11-bit identifier is wanted, by the predefined connection set (CiA 301, 7.3.3); nothing: by everybody, or
    /// nobody knows. `produced_to_master`: what nodes produce (TPDO, EMCY, heartbeat) goes to the NMT master alone. [realtime] sender
    std::optional<Address> where(std::uint32_t id, bool produced_to_master) const noexcept;

private:
    static constexpr std::uint64_t known = 1ULL << 48, fixed = 1ULL << 49, doubtful = 1ULL << 50;
    static constexpr unsigned master = 0;  ///< place of the NMT master

    struct Place {
        std::atomic<std::uint64_t> is{0};
        std::int64_t heard_ns = 0, other_ns = 0;  // the receiver's: when from there, when from elsewhere
    };
    bool learn(Place&, const Address&, std::int64_t now_ns) noexcept;

    std::array<Place, 128> places_;
    std::array<std::atomic<std::uint64_t>, 128> asked_{};  ///< by whom the node's SDO server was asked last
};

/// Which packed frames came already, by sender and session.
class Streams {
public:
    struct Verdict {
        bool fresh = true;       ///< false: a copy, or overtaken by a later one
        std::uint32_t lost = 0;  ///< frames missing before it
    };
    /// [realtime] receiver
    Verdict take(const Address& from, bool to_all, Stamp, std::int64_t now_ns) noexcept;

private:
    static constexpr unsigned most = 128;      ///< sessions, one or two of a sender; the one silent for longest makes room
    static constexpr unsigned stale_most = 8;  ///< old ones in a row: it is the memory here that is wrong
    struct Sender {
        std::uint64_t key = 0;
        std::int64_t heard_ns = INT64_MIN;
        struct Stream {
            std::uint16_t last = 0;
            std::uint8_t stale = 0;
            bool begun = false;
        } stream[2];
    };
    std::array<Sender, most> senders_;
};

/// Counts the frames to each destination. Frames leave from more than one thread.
class Sequences {
public:
    std::uint16_t next(const Address& to) noexcept;  ///< [realtime] any thread
    void take_back(const Address& to) noexcept;      ///< the last one was not used. [realtime] any thread
    void clear() noexcept;                           ///< [setup]

private:
    static constexpr std::uint64_t nobody = ~0ULL;
    struct Counter {
        std::atomic<std::uint64_t> key{nobody};
        std::atomic<std::uint16_t> count{0};
    };
    std::atomic<std::uint16_t>& of(const Address& to) noexcept;
    std::array<Counter, 256> counters_;  // broadcast, 127 nodes, and some that moved; the last is of all for whom there is no place
};

}  // namespace hal::can::cane
