// SPDX-License-Identifier: MIT
// Is a station there, and how long does a question and its answer take? Both leave in their sender's own slot, when real-time frames have
// left room in it; a station has one ping on its way to each other one, and owes each asker one answer at most.
#pragma once

#include <array>
#include <vector>

#include "station_setup.hpp"

namespace hal::tdma {

/// How a ping ended.
enum class Outcome : std::uint8_t {
    none,         ///< none has ended yet
    answered,
    unanswered,   ///< it left, and nothing came back in time
    no_room,      ///< it never left: frames filled the slots of this station, or it has none
    no_address,   ///< it never left: the station was not heard yet, and its `mac` is not in the schedule
    not_running,  ///< it never left: this station might not send
};

class Pings {
public:
    static constexpr Time patience = 1'000'000'000;  ///< from the wish to the answer

    struct Asked {
        std::uint32_t number = 0;   ///< of the newest
        std::uint32_t done = 0;     ///< of the newest that ended
        Outcome       outcome = Outcome::none;
        Time          round_trip = 0;  ///< on this station's clock, from the frame's leaving to the answer's coming
        Time          held = 0;        ///< of it: at the other station, on that one's clock
    };
    struct Owed {
        Address       to{};
        Time          ping_stamp = 0, received = 0;
        std::uint32_t number = 0;
    };

    /// As many as there are others in the setup. [setup]
    explicit Pings(std::size_t others = 0) : list_(others) {}
    std::size_t  size() const noexcept { return list_.size(); }
    const Asked& operator[](std::size_t n) const noexcept { return list_[n].asked; }

    /// Another one to that station; what was on its way to it counts no more. [realtime]
    void ask(std::size_t n, std::uint32_t number) noexcept;
    /// The next station whose ping waits for a turn; size(): none. [realtime]
    std::size_t waiting() const noexcept;
    void        sent(std::size_t n, const Address& to, Time not_before) noexcept;  ///< [realtime]
    void        fail(std::size_t n, Outcome why) noexcept { end(list_[n], why); }   ///< [realtime]
    /// True: it answers the ping that is on its way. [realtime]
    bool take(std::size_t n, const Address& from, const Echo& echo, Time arrived) noexcept;
    /// Once a cycle: what has waited too long has ended. [realtime]
    void look(Time now, Time longest, bool running) noexcept;

    /// Somebody asked. [realtime]
    void owe(const Owed&) noexcept;
    /// The oldest answer that waits for a turn; nullptr: none. [realtime]
    const Owed* owed() const noexcept { return owing_ == 0 ? nullptr : &owed_.front(); }
    void        paid() noexcept;  ///< [realtime]
    void        forgive() noexcept { owing_ = 0; }  ///< [realtime]

private:
    enum class Step : std::uint8_t { idle, wanted, sent };
    struct Entry {
        Asked   asked;
        Step    step = Step::idle;
        Address to{};
        Time    began = 0, not_before = 0;  // local; began 0: in this cycle
    };
    static void end(Entry& e, Outcome how) noexcept { e.step = Step::idle, e.asked.done = e.asked.number, e.asked.outcome = how; }

    std::vector<Entry>   list_;
    std::array<Owed, 16> owed_{};
    std::size_t          owing_ = 0;
};

}  // namespace hal::tdma
