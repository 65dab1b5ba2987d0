// SPDX-License-Identifier: MIT
#include "fieldbus/scocan/station/transmitter.hpp"

#include <algorithm>
#include <utility>

#include "link/timing.hpp"

namespace hal::scocan {

void Transmitter::forget() noexcept {
    announced_ = {};
    values_.fill({});
    last_call_ = INT64_MIN;
}

can::Sent Transmitter::drop(can::Sent why) noexcept {
    ++core_.count.dropped;
    return why;
}

/// Drops a frame whose identifier is reserved or of another node; the first of each identifier is
/// reported.
can::Sent Transmitter::not_allowed(std::uint32_t id, std::uint32_t sender) noexcept {
    if (!std::exchange(not_allowed_[id], true)) {
        core_.raise(Event::not_allowed, sender, id);
    }
    return drop(can::Sent::rejected);
}

can::Sent Transmitter::send(const can::Frame& frame, bool state, std::uint32_t slot) noexcept {
    const Table& table = core_.table;
    if (frame.extended || frame.fd || !frame.valid() || table.last_start(frame.length) < 0) {
        return drop(can::Sent::rejected);
    }
    const std::uint32_t sender = slot_monitor_.owner_of(frame.id);
    const bool of_other = sender != no_node && sender != core_.node;
    if (is_reserved(frame.id) || of_other) return not_allowed(frame.id, sender);
    bool priv = table.owner(modes_.mode(), frame.id) != nullptr;
    if (slot != no_slot) {
        const Use* use =
            slot < table.slots ? table.use(modes_.mode(), slot, core_.counter) : nullptr;
        if (use == nullptr || use->node != core_.node || !use->carries(frame.id)) {
            return drop(can::Sent::rejected);
        }
        priv = true;
    }
    // kept until the node runs, it would reach receivers as a fresh one
    if (core_.state != State::running) return drop(can::Sent::down);
    if (priv && state) {
        Value& v = values_[frame.id];
        if (v.last != last_call_) {
            v.since = core_.now;
        }
        v.last = core_.now;
    }
    if (core_.queue.push(frame, slot, priv, state)) return can::Sent::queued;
    return drop(can::Sent::full);
}

bool Transmitter::may_send(std::uint64_t cycle) const noexcept {
    return core_.state == State::running && modes_.settled(cycle);
}

/// A slot that is private in some cycles only may be so in this one while the counter is unknown.
Transmitter::Slot Transmitter::slot_at(const SlotIndex& at) const noexcept {
    const Use* use = core_.table.use(modes_.of(at.cycle), at.slot, core_.counter_of(at.cycle));
    return {use, core_.numbered || (use != nullptr && use->every <= 1)};
}

void Transmitter::advance() noexcept {
    if (++next_.slot == core_.table.slots) {
        next_.slot = 0;
        ++next_.cycle;
    }
}

/// Plans from a moment on; a slot that began more than `slack` before is over.
void Transmitter::resume_at(const SlotTime& w, Time slack) noexcept {
    next_ = {w.at.cycle, w.known ? w.at.slot : 0};
    if (w.offset > slack) {
        advance();
    }
}

void Transmitter::transmit(Time now, Time period) noexcept {
    if (core_.windows) {
        plan_ahead(now, period);
    } else {
        count_turns(now, period);
        start_now(now);
    }
}

// With transmit windows.

void Transmitter::plan_ahead(Time now, Time period) noexcept {
    const Time slack = std::min(period / 4, core_.table.enabled() / 2);
    Time begin = core_.begin_of(next_);
    // the first call, a late one, or the clock has jumped
    if (begin < now - slack || begin > now + period + 2 * core_.table.cycle) {
        resume_at(core_.where(now), slack);
        begin = core_.begin_of(next_);
    }
    while (begin < now + period - slack) {
        plan(next_, begin);
        advance();
        begin = core_.begin_of(next_);
    }
    if (!core_.senses) {
        recycle_announced(now);
    }
}

void Transmitter::plan(const SlotIndex& at, Time begin) noexcept {
    if (at.slot == 0) return sync_.plan(at.cycle);
    if (!may_send(at.cycle)) return;
    const Slot slot = slot_at(at);
    if (!slot.certain) return;
    if (slot.shared()) return plan_shared(begin, {.not_before_ns = begin});
    if (is_own(slot) && plan_private(*slot.use, at.slot, begin)) return;
    plan_idle(at.slot, begin);
}

/// Queues the frame of an own slot on the link. Returns false when no frame is due.
bool Transmitter::plan_private(const Use& use, std::uint32_t slot, Time begin) noexcept {
    const Table& table = core_.table;
    SendQueue::Entry* e = next_private(use, slot);
    if (e == nullptr) {
        e = repeated(use, slot);
    }
    if (e == nullptr) return false;
    const Time window = core_.single_shot ? table.enabled() : table.last_start(e->frame.length);
    e->in_flight = core_.send(e->frame, {.not_before_ns = begin,
                                         .last_start_ns = begin + window,
                                         .single_shot = core_.single_shot});
    e->until = begin + table.slot() - table.guard;
    e->planned = core_.now;
    return true;
}

/// Uses a private slot if its owner does not: the monitor announces it, nodes of type A send.
void Transmitter::plan_idle(std::uint32_t slot, Time begin) noexcept {
    const Table& table = core_.table;
    const Time idle_from = begin - table.guard / 2;
    const Time idle_until = begin + table.idle - table.bits(1);
    if (core_.role == Role::monitor) {
        const Time at = begin + table.idle;
        core_.send(announcement(slot),
                   {at, at + table.guard - table.bits(1), idle_from, idle_until, true});
    } else if (core_.senses) {
        plan_shared(begin, {.not_before_ns = begin + table.idle + table.guard,
                            .idle_from_ns = idle_from,
                            .idle_until_ns = idle_until});
    }
}

/// Hands over the shared frames that may fit into a slot, from the begin of the window on. The
/// controller discards those that do not start in time; they wait for the next slot.
void Transmitter::plan_shared(Time begin, const can::Window& window) noexcept {
    const Table& table = core_.table;
    Time from = window.not_before_ns;
    while (SendQueue::Entry* e = next_shared(from - begin)) {
        can::Window w = window;
        w.last_start_ns = begin + table.last_start(e->frame.length);
        e->in_flight = core_.send(e->frame, w);
        if (!e->in_flight) return;
        e->until = begin + table.slot() - table.guard;
        from += table.bits(can::frame_bits(e->frame).nominal);
    }
}

/// Uses the rest of a slot that the monitor has announced as idle.
void Transmitter::recycle_announced(Time now) noexcept {
    const SlotIndex announced = std::exchange(announced_, {});
    if (announced.slot == no_slot) return;
    const SlotTime w = core_.where(now);
    if (w.at == announced && may_send(w.at.cycle)) {
        plan_shared(core_.begin_of(w.at), {.not_before_ns = now});
    }
}

// The next frame of the queue.

SendQueue::Entry* Transmitter::next_private(const Use& use, std::uint32_t slot) noexcept {
    const auto fits = [&](const SendQueue::Entry& e) {
        return e.priv && (e.slot == no_slot || e.slot == slot) && use.carries(e.frame.id);
    };
    for (std::size_t k = 1; k <= use.ids.size(); ++k) {  // identifiers that share a slot take turns
        const auto index = (last_index_[slot] + k) % use.ids.size();
        SendQueue::Entry* e = core_.queue.next([&](const SendQueue::Entry& one) {
            return one.frame.id == use.ids[index] && fits(one);
        });
        if (e == nullptr) continue;
        last_index_[slot] = static_cast<std::uint8_t>(index);
        return e;
    }
    return core_.queue.next(fits);
}

/// Returns the next shared frame that may start `offset` behind the begin of a slot.
SendQueue::Entry* Transmitter::next_shared(Time offset) noexcept {
    return core_.queue.next([&](const SendQueue::Entry& e) {
        return !e.priv && offset <= core_.table.last_start(e.frame.length);
    });
}

/// In a thread slower than the turns of a slot, the newest value is sent again in each of them. A
/// bridge sends each frame of its participant once.
SendQueue::Entry* Transmitter::repeated(const Use& use, std::uint32_t slot) noexcept {
    if (core_.role == Role::bridge) return nullptr;
    for (std::size_t k = 1; k <= use.ids.size(); ++k) {
        const auto index = (last_index_[slot] + k) % use.ids.size();
        const SendQueue::Entry* before = core_.queue.handed_over(use.ids[index], core_.now);
        if (before == nullptr || (before->slot != no_slot && before->slot != slot)) continue;
        const can::Frame frame = before->frame;
        if (!core_.queue.push(frame, before->slot, true, true)) {
            ++core_.count.missed;
            return nullptr;
        }
        last_index_[slot] = static_cast<std::uint8_t>(index);
        return core_.queue.next(
            [&](const SendQueue::Entry& e) { return e.priv && e.state && e.frame.id == frame.id; });
    }
    return nullptr;
}

// Without transmit windows.

/// Counts the turns of own slots that passed since the last call without a cycle of the thread in
/// their window, although a value was there.
void Transmitter::count_turns(Time now, Time period) noexcept {
    Time begin = core_.begin_of(next_);
    // the first call, or the clock has jumped
    if (begin < now - 2 * period - core_.table.cycle || begin > now + core_.table.cycle) {
        resume_at(core_.where(now), INT64_MAX);
        begin = core_.begin_of(next_);
    }
    while (begin + core_.table.enabled() < now) {
        const Slot slot = may_send(next_.cycle) ? slot_at(next_) : Slot{};
        const bool own = core_.numbered && is_own(slot) && slot.use->kind == Kind::priv;
        if (own && core_.used != next_) {
            count_missed_turn(*slot.use, begin, period);
        }
        advance();
        begin = core_.begin_of(next_);
    }
}

void Transmitter::count_missed_turn(const Use& use, Time begin, Time period) noexcept {
    for (const std::uint32_t id : use.ids) {
        const Value& v = values_[id];
        if (v.last != core_.now || core_.crystal.local(v.since) > begin) continue;
        ++core_.count.missed;
        if (period > core_.table.enabled()) {
            core_.raise(Event::slot_missed, core_.node, id, period);
        }
        return;
    }
}

/// Returns true when the rest of an idle private slot may be used.
bool Transmitter::recycles(const SlotTime& w, bool was_idle) const noexcept {
    if (!core_.senses) return announced_ == w.at;
    return was_idle && w.offset >= core_.table.idle + core_.table.guard;
}

/// Sends a frame that may start now.
void Transmitter::start(SendQueue::Entry& e, const SlotTime& w) noexcept {
    e.in_flight = core_.send(e.frame, {});
    e.until = core_.begin_of(w.at) + core_.table.slot();
    core_.used = w.at;
}

/// Sends what may start now, one frame at a time.
void Transmitter::start_now(Time now) noexcept {
    const Table& table = core_.table;
    const SlotTime w = core_.where(now);
    if (!w.known) return;
    if (w.at.slot == 0) return sync_.plan(w.at.cycle);
    if (!may_send(w.at.cycle) || core_.queue.flying()) return;
    const Slot slot = slot_at(w.at);
    if (!slot.certain) return;
    const bool used = core_.used == w.at;
    if (is_own(slot) && !used && w.offset <= table.enabled()) {
        SendQueue::Entry* e = next_private(*slot.use, w.at.slot);
        if (e != nullptr) return start(*e, w);
    }
    const bool was_idle = core_.last_begin < core_.begin_of(w.at) - table.guard;
    const bool monitors = core_.role == Role::monitor && !slot.shared();
    if (monitors && !used && was_idle && w.offset >= table.idle) {
        core_.used = w.at;
        core_.send(announcement(w.at.slot), {});
        return;
    }
    if (!slot.shared() && !used && !recycles(w, was_idle)) return;
    if (SendQueue::Entry* e = next_shared(w.offset)) {
        start(*e, w);
    }
}

}  // namespace hal::scocan
