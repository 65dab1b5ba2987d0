// SPDX-License-Identifier: MIT
#include "flying_master.hpp"

namespace hal::canopen {

namespace {

// CiA 302-2, the flying master's services.
constexpr std::uint32_t is_master = 0x71, negotiation = 0x72, who_is_master = 0x73, is_capable = 0x74, who_is_capable = 0x75, force = 0x76;
constexpr std::uint32_t heartbeats = 0x700;

}  // namespace

const char* to_string(FlyingMaster::State s) noexcept {
    switch (s) {
    case FlyingMaster::State::off: return "off";
    case FlyingMaster::State::waiting: return "waiting";
    case FlyingMaster::State::asking: return "asking for the active master";
    case FlyingMaster::State::negotiating: return "negotiating";
    case FlyingMaster::State::passive: return "passive";
    case FlyingMaster::State::active: return "active";
    }
    return "?";
}

std::vector<std::string> problems_of(const FlyingSetup& s) {
    std::vector<std::string> problems;
    if (!s.enabled) return problems;
    if (s.id < 1 || s.id > 127) problems.emplace_back("a flying master needs a node-id from 1 to 127");
    if (s.priority > 2) problems.emplace_back("the priority of a flying master is 0, 1 or 2");
    if (s.timeout <= 0 || s.device_slot <= 0) problems.emplace_back("the times of a flying master must be longer than 0");
    if (s.priority_slot <= 127 * s.device_slot)
        problems.emplace_back(
            "the priority slot of a flying master must be longer than 127 of its device slots, or a master of less priority could win");
    return problems;
}

void FlyingMaster::enter(State state, Time now, Time wait) noexcept {
    state_ = state;
    until_ = now + wait;
    if (state != State::passive && state != State::active) master_ = master_priority_ = 0;
}

void FlyingMaster::say(std::uint32_t id, bool whom) noexcept {
    Frame f = make_frame(id, whom ? 2 : 0);
    if (whom) f.data[0] = setup_.priority, f.data[1] = setup_.id;
    out_.push(f);
}

void FlyingMaster::start(Time now) noexcept {
    if (!setup_.enabled) return;
    forced_ = false;
    enter(State::waiting, now, setup_.delay);
}

void FlyingMaster::negotiate(Time now) noexcept {
    ++negotiations_;
    enter(State::negotiating, now, turn());
}

void FlyingMaster::give_way(std::uint8_t priority, std::uint8_t id, Time now) noexcept {
    enter(State::passive, now, 0);
    master_ = id, master_priority_ = priority;
    heard_ = now;
}

void FlyingMaster::win(Time now) noexcept {
    enter(State::active, now, 0);
    master_ = setup_.id, master_priority_ = setup_.priority;
    next_look_ = now + setup_.look_every();
    say(is_master, true);
}

/// There shall be a negotiation: all wait, and whoever is through first calls for it.
void FlyingMaster::call_for_negotiation(Time now) noexcept {
    say(force, false);
    await_negotiation(now);
}

void FlyingMaster::await_negotiation(Time now) noexcept {
    forced_ = true;
    enter(State::waiting, now, setup_.delay);
}

/// Somebody says that it is the active master.
void FlyingMaster::heard_master(std::uint8_t priority, std::uint8_t id, Time now) noexcept {
    if (id == setup_.id) return;  // ours, or one with our id, which is another fault
    if (state_ == State::active) return call_for_negotiation(now);  // two: the bus was in halves, or one was away
    // A network that runs is taken over for a better priority only, not for a lower node-id; in a negotiation both count.
    const bool worse = state_ == State::negotiating ? !better(priority, id) : priority > setup_.priority;
    if (worse && !(state_ == State::passive && id == master_)) return call_for_negotiation(now);
    give_way(priority, id, now);
}

bool FlyingMaster::handle(const Frame& f, Time now) noexcept {
    if (f.error || f.extended || f.fd || f.remote) return false;
    if (state_ == State::passive && f.id == heartbeats + master_) {
        heard_ = now;
        return false;
    }
    if (f.id < is_master || f.id > force) return false;
    if (state_ == State::off) return true;
    switch (f.id) {
    case is_master:
        if (f.length >= 2 && f.data[1] >= 1 && f.data[1] <= 127) heard_master(f.data[0], f.data[1], now);
        break;
    case negotiation: negotiate(now); break;
    case who_is_master:
        if (state_ == State::active) say(is_master, true);
        break;
    case who_is_capable: say(is_capable, true); break;
    case force: await_negotiation(now); break;
    default: break;
    }
    return true;
}

void FlyingMaster::poll(Time now) noexcept {
    switch (state_) {
    case State::off: return;
    case State::waiting:
        if (now < until_) return;
        if (forced_) {
            forced_ = false;
            say(negotiation, false);
            return negotiate(now);
        }
        say(who_is_master, false);
        return enter(State::asking, now, setup_.timeout);
    case State::asking:
        if (now < until_) return;
        say(negotiation, false);
        return negotiate(now);
    case State::negotiating:
        if (now >= until_) win(now);
        return;
    case State::passive:
        if (now - heard_ <= setup_.silence) return;
        ++losses_;
        forced_ = false;
        say(who_is_master, false);  // it may only have lost its heartbeat
        return enter(State::asking, now, setup_.timeout);
    case State::active:
        if (now < next_look_) return;
        next_look_ = now + setup_.look_every();
        return say(who_is_master, false);
    }
}

}  // namespace hal::canopen
