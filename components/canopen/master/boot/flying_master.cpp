// SPDX-License-Identifier: MIT
#include "flying_master.hpp"

#include "text/text_table.hpp"

namespace hal::canopen {

namespace {

// The identifiers of the flying master services of CiA 302-2.
constexpr std::uint32_t is_master = 0x71;
constexpr std::uint32_t negotiation = 0x72;
constexpr std::uint32_t who_is_master = 0x73;

constexpr std::uint32_t is_capable = 0x74;
constexpr std::uint32_t who_is_capable = 0x75;
constexpr std::uint32_t force = 0x76;
constexpr std::uint32_t heartbeats = 0x700;

}  // namespace

const char* to_string(FlyingMaster::State s) noexcept {
    constexpr TextRow<FlyingMaster::State> texts[] = {
        {FlyingMaster::State::off, "off"},
        {FlyingMaster::State::waiting, "waiting"},
        {FlyingMaster::State::asking, "asking for the active master"},
        {FlyingMaster::State::negotiating, "negotiating"},
        {FlyingMaster::State::passive, "passive"},
        {FlyingMaster::State::active, "active"},
    };
    return find_text(texts, s, "?");
}

std::vector<std::string> problems_of(const FlyingSetup& s) {
    std::vector<std::string> problems;
    if (!s.enabled) return problems;
    if (s.id < 1 || s.id > 127) {
        problems.emplace_back("invalid node ID of the flying master; use 1 to 127");
    }
    if (s.priority > 2) {
        problems.emplace_back("invalid priority of the flying master; use 0, 1 or 2");
    }
    if (s.timeout <= 0 || s.device_slot <= 0) {
        problems.emplace_back("the times of a flying master must be above 0");
    }
    if (s.priority_slot <= 127 * s.device_slot) {
        problems.emplace_back(
            "the priority slot of a flying master must be longer than 127 of its device slots, "
            "otherwise a master of lower priority could win");
    }
    return problems;
}

void FlyingMaster::enter(State state, Time now, Time wait) noexcept {
    state_ = state;
    until_ = now + wait;
    if (state != State::passive && state != State::active) {
        master_ = master_priority_ = 0;
    }
}

void FlyingMaster::send(std::uint32_t id, bool with_identity) noexcept {
    Frame f = make_frame(id, with_identity ? 2 : 0);
    if (with_identity) {
        f.data[0] = setup_.priority;
        f.data[1] = setup_.id;
    }
    out_.push(f);
}

void FlyingMaster::start(Time now) noexcept {
    if (!setup_.enabled) return;
    forced_ = false;
    enter(State::waiting, now, setup_.delay);
}

void FlyingMaster::negotiate(Time now) noexcept {
    ++negotiations_;
    enter(State::negotiating, now, slot_delay());
}

void FlyingMaster::become_passive(std::uint8_t priority, std::uint8_t id, Time now) noexcept {
    enter(State::passive, now, 0);
    master_ = id;
    master_priority_ = priority;
    heard_ = now;
}

void FlyingMaster::win(Time now) noexcept {
    enter(State::active, now, 0);
    master_ = setup_.id;
    master_priority_ = setup_.priority;
    next_search_ = now + setup_.search_interval();
    send(is_master, true);
}

/// Forces a negotiation: every device waits for its delay, and the first one to finish starts it.
void FlyingMaster::call_for_negotiation(Time now) noexcept {
    send(force, false);
    await_negotiation(now);
}

void FlyingMaster::await_negotiation(Time now) noexcept {
    forced_ = true;
    enter(State::waiting, now, setup_.delay);
}

/// Another device announces that it is the active master.
void FlyingMaster::heard_master(std::uint8_t priority, std::uint8_t id, Time now) noexcept {
    // this device, or a duplicate node ID, which is reported elsewhere
    if (id == setup_.id) return;
    // two active masters: the bus was split, or one was disconnected
    if (state_ == State::active) return call_for_negotiation(now);
    // A running network is taken over only for a better priority, not for a lower node ID; in a
    // negotiation both count.
    const bool worse =
        state_ == State::negotiating ? !better(priority, id) : priority > setup_.priority;
    if (worse && !(state_ == State::passive && id == master_)) return call_for_negotiation(now);
    become_passive(priority, id, now);
}

bool FlyingMaster::handle(const Frame& f, Time now) noexcept {
    if (!f.is_standard_data()) return false;
    if (state_ == State::passive && f.id == heartbeats + master_) {
        heard_ = now;
        return false;
    }
    if (f.id < is_master || f.id > force) return false;
    if (state_ == State::off) return true;
    switch (f.id) {
    case is_master:
        if (f.length >= 2 && f.data[1] >= 1 && f.data[1] <= 127) {
            heard_master(f.data[0], f.data[1], now);
        }
        break;
    case negotiation: negotiate(now); break;
    case who_is_master:
        if (state_ == State::active) {
            send(is_master, true);
        }
        break;
    case who_is_capable: send(is_capable, true); break;
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
            send(negotiation, false);
            return negotiate(now);
        }
        send(who_is_master, false);
        return enter(State::asking, now, setup_.timeout);
    case State::asking:
        if (now < until_) return;
        send(negotiation, false);
        return negotiate(now);
    case State::negotiating:
        if (now >= until_) {
            win(now);
        }
        return;
    case State::passive:
        if (now - heard_ <= setup_.silence) return;
        ++losses_;
        forced_ = false;
        send(who_is_master, false);  // only its heartbeat may have been lost
        return enter(State::asking, now, setup_.timeout);
    case State::active:
        if (now < next_search_) return;
        next_search_ = now + setup_.search_interval();
        return send(who_is_master, false);
    }
}

}  // namespace hal::canopen
