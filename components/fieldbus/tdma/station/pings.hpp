// SPDX-License-Identifier: MIT
// Pings between stations: reachability and round-trip time. Request and answer use the time that
// real-time frames leave in their senders' slots. A station has at most one pending ping to each
// other station, and one pending answer for each.
#pragma once

#include <array>
#include <vector>

#include "station_setup.hpp"

namespace hal::tdma {

/// How a ping ended.
enum class Outcome : std::uint8_t {
    none,         ///< no ping has ended yet
    answered,
    unanswered,   ///< sent, but no answer within the timeout
    no_room,      ///< not sent: no space in the slots of this station
    no_address,  ///< not sent: no frame of the station received yet, and no `mac` in the schedule
    not_running,  ///< not sent: this station was not running
};

class Pings {
public:
    static constexpr Time timeout = 1'000'000'000;  ///< ns, from ask() to the answer

    struct Asked {
        std::uint32_t number = 0;  ///< of the last ping
        std::uint32_t done = 0;  ///< of the last ping that ended
        Outcome outcome = Outcome::none;
        Time round_trip = 0;  ///< ns on this station's clock, from sending to reception
        Time held = 0;  ///< ns of it at the other station, on its clock
    };
    struct Owed {
        Address to{};
        Time ping_stamp = 0;
        Time received = 0;
        std::uint32_t number = 0;
    };

    /// Allocates an entry per other station of the setup. [setup]
    explicit Pings(std::size_t others = 0) : list_(others) {}
    std::size_t size() const noexcept { return list_.size(); }
    const Asked& operator[](std::size_t n) const noexcept { return list_[n].asked; }

    /// Requests a ping to station `n`; cancels a pending one. [realtime]
    void ask(std::size_t n, std::uint32_t number) noexcept;
    /// Returns the next station whose ping is to be sent; size(): none. [realtime]
    std::size_t waiting() const noexcept;
    /// Notes that the ping was sent, no earlier than `not_before` (local ns). [realtime]
    void sent(std::size_t n, const Address& to, Time not_before) noexcept;
    /// Ends the ping without an answer. [realtime]
    void fail(std::size_t n, Outcome why) noexcept { end(list_[n], why); }
    /// Evaluates an answer. Returns true when it answers the pending ping. [realtime]
    bool accept(std::size_t n, const Address& from, const Echo& echo, Time arrived) noexcept;
    /// Ends pings older than `timeout_ns`; called once a cycle. [realtime]
    void expire(Time now, Time timeout_ns, bool running) noexcept;

    /// Queues an answer; replaces a pending one to the same station. [realtime]
    void queue_answer(const Owed&) noexcept;
    /// Returns the oldest queued answer; nullptr: none. [realtime]
    const Owed* answer() const noexcept { return answers_ == 0 ? nullptr : &queue_.front(); }
    /// Removes the oldest queued answer. [realtime]
    void pop_answer() noexcept;
    /// Removes all queued answers. [realtime]
    void clear_answers() noexcept { answers_ = 0; }

private:
    enum class Step : std::uint8_t { idle, wanted, sent };
    struct Entry {
        Asked asked;
        Step step = Step::idle;
        Address to{};
        Time began = 0;
        Time not_before = 0;  // local; began 0: in this cycle
    };
    static void end(Entry& e, Outcome how) noexcept {
        e.step = Step::idle;
        e.asked.done = e.asked.number;
        e.asked.outcome = how;
    }

    std::vector<Entry> list_;
    std::array<Owed, 16> queue_{};
    std::size_t answers_ = 0;
};

}  // namespace hal::tdma
