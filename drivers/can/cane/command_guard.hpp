// SPDX-License-Identifier: MIT
// Access control for commands: NMT, SYNC, TIME and set-points (RPDO 1 to 4 of the predefined
// connection set) are accepted from one station, the master; others are rejected while it is alive.
// Nothing is allocated after construction. Used by the receiving thread, except sent().
#pragma once

#include <atomic>
#include <cstdint>
#include <vector>

#include "cane_format.hpp"

namespace hal::can::cane {

/// Accepts commands from the master only.
class Guard {
public:
    /// timeout after which another station may become the master
    static constexpr std::int64_t alive_ns = 1'000'000'000;

    /// Sets the master. [setup]
    void fix(const ethernet::Address& master) {
        master_ = master;
        known_ = fixed_ = true;
    }
    /// Also accepts commands of `other`. [setup]
    void allow(const ethernet::Address& other) { allowed_.push_back(other); }
    /// Switches learning on or off; without learning and fix(), commands of any station are
    /// accepted. [setup]
    void learn(bool on) { learns_ = on; }

    /// Returns true for a command. [any]
    static bool commands(const Frame& f) noexcept {
        if (f.extended || f.remote) return false;
        const std::uint32_t code = f.id & 0x780;
        const std::uint32_t node = f.id & 0x7f;
        const bool is_rpdo =
            node != 0 && (code == 0x200 || code == 0x300 || code == 0x400 || code == 0x500);
        return f.id == 0x000 || f.id == 0x080 || f.id == 0x100 || is_rpdo;
    }
    /// Returns true for the negotiation of flying masters (CiA 302-2: 071h to 076h): the next
    /// master may command at once. [any]
    static bool negotiates(const Frame& f) noexcept {
        return !f.extended && f.id >= 0x071 && f.id <= 0x076;
    }

    /// Returns whether the station may command; with no master alive, it becomes the master.
    /// [realtime] receiver
    bool may_command(const ethernet::Address& from, std::int64_t now_ns) noexcept {
        for (const auto& other : allowed_) {
            if (other == from) return true;
        }
        const auto own = own_ns_.load(std::memory_order_relaxed);
        if (fixed_) return from == master_;
        if (!learns_) return true;
        // this station is the master
        if (own != INT64_MIN && now_ns - own < alive_ns) return false;
        if (known_ && from != master_ && now_ns - last_received_ns_ < alive_ns) return false;
        known_ = true;
        master_ = from;
        last_received_ns_ = now_ns;
        return true;
    }
    /// Forgets a learnt master. [realtime] receiver
    void release() noexcept {
        if (!fixed_) {
            known_ = false;
        }
        own_ns_.store(INT64_MIN, std::memory_order_relaxed);
    }
    /// Records a command that this link sent. [realtime] sender
    void sent(const Frame& f, std::int64_t now_ns) noexcept {
        if (commands(f)) {
            own_ns_.store(now_ns, std::memory_order_relaxed);
        }
    }

private:
    std::vector<ethernet::Address> allowed_;
    ethernet::Address master_{};
    bool known_ = false;
    bool fixed_ = false;
    bool learns_ = true;
    std::int64_t last_received_ns_ = 0;
    std::atomic<std::int64_t> own_ns_{INT64_MIN};
};

/// Rejected frames, reported at most once a second; those in between are counted.
class Rejections {
public:
    /// Adds a rejected frame. [realtime] receiver
    void add(Rejected::Why why, std::uint32_t id, const ethernet::Address& from,
             std::int64_t now_ns) noexcept {
        std::uint64_t number = 0;
        for (const auto byte : from) {
            number = number << 8 | byte;
        }
        if (waiting_.count == 0) {
            waiting_ = {why, id, number, 0};
        }
        ++waiting_.count;
        now_ns_ = now_ns;
    }
    /// Takes a report that is due; false: none. [realtime] receiver
    bool take(Rejected& out) noexcept {
        if (waiting_.count == 0 || (reported_ && now_ns_ - reported_ns_ < 1'000'000'000)) {
            return false;
        }
        out = waiting_;
        waiting_ = {};
        reported_ = true;
        reported_ns_ = now_ns_;
        return true;
    }

private:
    Rejected waiting_;
    bool reported_ = false;
    std::int64_t now_ns_ = 0;
    std::int64_t reported_ns_ = 0;
};

/// Detects replayed frames by the newest counter of each sender of signed frames.
class Replays {
public:
    /// Returns false for a replayed frame. Call it after its tag is verified. [realtime] receiver
    bool fresh(const ethernet::Address& from, std::uint64_t counter) noexcept {
        Sender* s = nullptr;
        for (auto& candidate : senders_) {
            if (candidate.counter != 0 && candidate.from == from) {
                s = &candidate;
            }
        }
        if (s == nullptr) {
            s = &senders_[0];
            for (auto& candidate : senders_) {
                if (candidate.counter < s->counter) {
                    s = &candidate;
                }
            }
            *s = {from, 0};
        }
        if (counter <= s->counter) return false;
        s->counter = counter;
        return true;
    }

private:
    struct Sender {
        ethernet::Address from{};
        std::uint64_t counter = 0;
    };
    std::array<Sender, 128> senders_{};
};

}  // namespace hal::can::cane
