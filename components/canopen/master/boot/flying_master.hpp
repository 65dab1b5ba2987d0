// SPDX-License-Identifier: MIT
// The flying master of CiA 302-2 elects one NMT master among several capable devices. The device
// with the best priority, then the lowest node ID, wins the negotiation; it leads until its
// heartbeat times out or a better device joins.
//
// A device waits after its start (1F90h:2), requests the active master (073h) and waits for the
// response (1F90h:1). The response of a better master (071h: priority, node ID) makes it passive;
// to a worse one it sends the force negotiation command (076h). Without a response it starts a
// negotiation (072h), in which every device waits for
//     priority * priority_slot + node ID * device_slot        (1F90h:3 to :5)
// A device that has received no 071h by then sends 071h and is the active master. An active master
// searches for others periodically (073h, 1F90h:6), so two halves of a bus that are joined detect
// each other and negotiate.
#pragma once

#include <string>
#include <vector>

#include "canopen/protocol/frames.hpp"

namespace hal::canopen {

/// The set-up of a flying master. Times in ns.
struct FlyingSetup {
    bool enabled = false;      ///< 1F80h bit 5
    std::uint8_t id = 127;             ///< node ID of this device
    std::uint8_t priority = 1;         ///< 1F90h:3: 0 (highest) to 2
    Time timeout = 100 * millisecond;  ///< 1F90h:1: response timeout for the active master
    /// 1F90h:2: delay before the first request, and before a negotiation forced by 076h
    Time delay = 500 * millisecond;
    Time priority_slot = 1500 * millisecond;  ///< 1F90h:4: longer than 127 device slots
    Time device_slot = 10 * millisecond;      ///< 1F90h:5
    /// 1F90h:6: interval of the search for other masters; 0: 4 s + 10 ms * node ID
    Time detect_cycle = 0;
    Time silence = 250 * millisecond;  ///< heartbeat timeout of the active master

    /// Returns the interval of the search for other masters in ns. [any]
    Time search_interval() const noexcept {
        return detect_cycle > 0 ? detect_cycle : 4 * second + 10 * millisecond * id;
    }
};

/// Returns a sentence for each invalid value. [setup]
std::vector<std::string> problems_of(const FlyingSetup&);

/// The election of the NMT master. All calls belong to one thread.
class FlyingMaster {
public:
    /// The state of this device.
    enum class State : std::uint8_t {
        off,
        waiting,      ///< delay before the request or the negotiation
        asking,       ///< requested the active master
        negotiating,  ///< waits for its time slot
        passive,      ///< another device is the active master
        active,       ///< this device is the active master
    };

    /// Creates the service; the queue outlives it. [setup]
    FlyingMaster(const FlyingSetup& setup, FrameQueue& out) noexcept : setup_(setup), out_(out) {}

    /// Starts from the beginning, if enabled. [realtime]
    void start(Time now) noexcept;
    /// Withdraws from the election until start(). [realtime]
    void stop() noexcept { enter(State::off, 0, 0); }
    /// Processes a frame; returns true if it belongs to the flying master services only. [realtime]
    bool handle(const Frame&, Time now) noexcept;
    /// Checks timers; call it once per cycle. [realtime]
    void poll(Time now) noexcept;

    /// Returns the state of this device. [realtime]
    State state() const noexcept { return state_; }
    /// Returns true if this device is the active master. [realtime]
    bool active() const noexcept { return state_ == State::active; }
    /// Returns the node ID of the active master; 0: unknown. [realtime]
    std::uint8_t master() const noexcept { return master_; }
    /// Returns the priority of the active master. [realtime]
    std::uint8_t master_priority() const noexcept { return master_priority_; }
    /// Returns the number of negotiations on this bus. [realtime]
    std::uint64_t negotiations() const noexcept { return negotiations_; }
    /// Returns the number of heartbeat timeouts of active masters. [realtime]
    std::uint64_t losses() const noexcept { return losses_; }
    /// Returns the set-up. [any]
    const FlyingSetup& setup() const noexcept { return setup_; }

    /// Returns the waiting time of this device in a negotiation, in ns. [any]
    Time slot_delay() const noexcept {
        return setup_.priority * setup_.priority_slot + setup_.id * setup_.device_slot;
    }

private:
    void enter(State, Time now, Time wait) noexcept;
    void negotiate(Time now) noexcept;
    void become_passive(std::uint8_t priority, std::uint8_t id, Time now) noexcept;
    void win(Time now) noexcept;
    void call_for_negotiation(Time now) noexcept;
    void await_negotiation(Time now) noexcept;
    void heard_master(std::uint8_t priority, std::uint8_t id, Time now) noexcept;
    void send(std::uint32_t id, bool whom) noexcept;
    bool better(std::uint8_t priority, std::uint8_t id) const noexcept {  // than this one
        return priority != setup_.priority ? priority < setup_.priority : id < setup_.id;
    }

    const FlyingSetup setup_;
    FrameQueue& out_;
    State state_ = State::off;
    Time until_ = 0;
    Time heard_ = 0;
    Time next_search_ = 0;
    std::uint8_t master_ = 0;
    std::uint8_t master_priority_ = 0;
    bool forced_ = false;  // the delay precedes a forced negotiation
    std::uint64_t negotiations_ = 0;
    std::uint64_t losses_ = 0;
};

/// Returns the state as a phrase. [any]
const char* to_string(FlyingMaster::State) noexcept;

}  // namespace hal::canopen
