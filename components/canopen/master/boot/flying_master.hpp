// SPDX-License-Identifier: MIT
// The flying master of CiA 302-2: which of several devices that can be the NMT master is it. The one that is best by priority, then by
// node-id, wins a negotiation; it leads until its heartbeat is missed or a better one comes. Like the other services it gets time and
// frames from outside and puts its frames into a queue.
//
// The way of a device: after its start it waits (1F90h:2), asks whether there is an active master (073h), and waits for the answer
// (1F90h:1). An answer of a better one (071h: priority, node-id) makes it passive; to a worse one it says that there shall be a
// negotiation (076h). Without an answer it calls for one (072h). In a negotiation everyone waits for
//     priority * priority_slot + node-id * device_slot        (1F90h:3 to :5)
// and who has heard nobody until then says 071h and is the master. As an active master asks for others now and then (073h, 1F90h:6), two
// halves of a bus that are joined find out, and negotiate.
#pragma once

#include <string>
#include <vector>

#include "canopen/protocol/frames.hpp"

namespace hal::canopen {

struct FlyingSetup {
    bool         enabled = false;      ///< 1F80h bit 5
    std::uint8_t id = 127;             ///< our node-id
    std::uint8_t priority = 1;         ///< 1F90h:3: 0 is the best, 2 the last
    Time timeout = 100 * millisecond;  ///< 1F90h:1: for the answer of an active master
    Time delay = 500 * millisecond;    ///< 1F90h:2: before it asks for the first time, and before a negotiation that was called for by 076h
    Time priority_slot = 1500 * millisecond;  ///< 1F90h:4: more than 127 device slots
    Time device_slot = 10 * millisecond;      ///< 1F90h:5
    Time detect_cycle = 0;             ///< 1F90h:6: how often an active master looks for others; 0: 4 s and 10 ms times the node-id
    Time silence = 250 * millisecond;  ///< of the active master's heartbeat after which it is taken for dead

    Time look_every() const noexcept { return detect_cycle > 0 ? detect_cycle : 4 * second + 10 * millisecond * id; }
};

/// A sentence for each thing that cannot be. [setup]
std::vector<std::string> problems_of(const FlyingSetup&);

class FlyingMaster {
public:
    enum class State : std::uint8_t {
        off,
        waiting,      ///< before it asks, or before a negotiation
        asking,       ///< is there an active master?
        negotiating,  ///< its slot has not come yet
        passive,      ///< another one is the active master
        active,       ///< this one is
    };

    FlyingMaster(const FlyingSetup& setup, FrameQueue& out) noexcept : setup_(setup), out_(out) {}  // [setup]

    void start(Time now) noexcept;  ///< from the beginning. [realtime]
    /// Nobody's master any more: until start(). [realtime]
    void stop() noexcept { enter(State::off, 0, 0); }
    /// Hands in every frame received; true: it was for the flying master alone. [realtime]
    bool handle(const Frame&, Time now) noexcept;
    /// Does what is due; once a cycle. [realtime]
    void poll(Time now) noexcept;

    State state() const noexcept { return state_; }
    bool active() const noexcept { return state_ == State::active; }
    std::uint8_t master() const noexcept { return master_; }              ///< node-id of the active master; 0: not known
    std::uint8_t master_priority() const noexcept { return master_priority_; }
    std::uint64_t negotiations() const noexcept { return negotiations_; }  ///< begun, by whomever
    std::uint64_t losses() const noexcept { return losses_; }              ///< active masters that fell silent
    const FlyingSetup& setup() const noexcept { return setup_; }

    /// When its slot of a negotiation comes.
    Time turn() const noexcept { return setup_.priority * setup_.priority_slot + setup_.id * setup_.device_slot; }

private:
    void enter(State, Time now, Time wait) noexcept;
    void negotiate(Time now) noexcept;
    void give_way(std::uint8_t priority, std::uint8_t id, Time now) noexcept;
    void win(Time now) noexcept;
    void call_for_negotiation(Time now) noexcept;
    void await_negotiation(Time now) noexcept;
    void heard_master(std::uint8_t priority, std::uint8_t id, Time now) noexcept;
    void say(std::uint32_t id, bool whom) noexcept;
    bool better(std::uint8_t priority, std::uint8_t id) const noexcept {  // than this one
        return priority != setup_.priority ? priority < setup_.priority : id < setup_.id;
    }

    const FlyingSetup setup_;
    FrameQueue&       out_;
    State         state_ = State::off;
    Time          until_ = 0, heard_ = 0, next_look_ = 0;
    std::uint8_t  master_ = 0, master_priority_ = 0;
    bool          forced_ = false;  // the wait is one before a negotiation
    std::uint64_t negotiations_ = 0, losses_ = 0;
};

const char* to_string(FlyingMaster::State) noexcept;

}  // namespace hal::canopen
