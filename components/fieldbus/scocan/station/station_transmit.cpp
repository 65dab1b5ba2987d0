// SPDX-License-Identifier: MIT
#include <algorithm>
#include <utility>

#include "link/timing.hpp"
#include "station.hpp"

namespace hal::scocan {

can::Sent Station::send(const can::Frame& frame, bool state, std::uint32_t slot) noexcept {
    if (frame.extended || frame.fd || !frame.valid() || table_.last_start(frame.length) < 0) {
        ++count_.dropped;
        return can::Sent::rejected;
    }
    if (const std::uint32_t sender = owner_of(frame.id);
        is_reserved(frame.id) || (sender != no_node && sender != node_)) {
        return not_allowed(frame.id, sender);
    }
    bool priv = table_.owner(mode_, frame.id) != nullptr;
    if (slot != no_slot) {
        const Use* use = slot < table_.slots ? table_.use(mode_, slot, counter_) : nullptr;
        if (use == nullptr || use->node != node_ || !use->carries(frame.id)) {
            ++count_.dropped;
            return can::Sent::rejected;
        }
        priv = true;
    }
    if (priv && state) {
        Value& v = values_[frame.id];
        if (v.last != last_call_) {
            v.since = now_;
        }
        v.last = now_;
    }
    if (queue_.push(frame, slot, priv, state)) return can::Sent::queued;
    ++count_.dropped;
    return can::Sent::full;
}

/// Drops a frame whose identifier is reserved or of another node; the first of each identifier is
/// reported.
can::Sent Station::not_allowed(std::uint32_t id, std::uint32_t sender) noexcept {
    ++count_.dropped;
    if (!std::exchange(not_allowed_[id], true)) {
        raise(Event::not_allowed, sender, id);
    }
    return can::Sent::rejected;
}

void Station::transmit(Time now, Time period) noexcept {
    if (link_ == nullptr || first_seen_ == INT64_MIN) return;
    now_ = now;
    const Time local = crystal_.local(now);
    if (is_sync_node() && state_ != State::down && state_ != State::silenced) {
        lead(local);
    }
    if (clock_.known()) {
        if (windows_) {
            plan_ahead(local, period);
        } else {
            count_turns(local, period);
            start_now(local);
        }
    }
    link_->flush(now);
    last_call_ = now;
}

/// Plans the slots that begin until the next call.
void Station::plan_ahead(Time now, Time period) noexcept {
    const Time slack = std::min(period / 4, table_.enabled() / 2);
    Time next = begin_of(next_cycle_, next_slot_);
    // the first call, a late one, or the clock has jumped
    if (next < now - slack || next > now + period + 2 * table_.cycle) {
        const Where w = where(now);
        next_cycle_ = w.cycle;
        next_slot_ = w.slot;
        if (w.offset > slack && ++next_slot_ == table_.slots) {
            next_slot_ = 0;
            ++next_cycle_;
        }
        next = begin_of(next_cycle_, next_slot_);
    }
    while (next < now + period - slack) {
        plan(next_cycle_, next_slot_, next);
        if (++next_slot_ == table_.slots) {
            next_slot_ = 0;
            ++next_cycle_;
        }
        next = begin_of(next_cycle_, next_slot_);
    }
    if (!senses_) {
        recycle_announced(now);
    }
}

bool Station::may_send(std::uint64_t cycle) const noexcept {
    if (state_ != State::running) return false;
    if (!armed_.prepared || armed_.confirmed || cycle < armed_.at) return true;
    // whether the mode changes is known from the SYNC of that cycle
    return clock_.cycle() >= armed_.at && clock_.seen();
}

std::uint32_t Station::mode_of(std::uint64_t cycle) const noexcept {
    return armed_.confirmed && cycle >= armed_.at ? armed_.mode : mode_;
}

SendQueue::Entry* Station::next_private(const Use& use, std::uint32_t slot) noexcept {
    const auto fits = [&](const SendQueue::Entry& e) {
        return e.priv && (e.slot == no_slot || e.slot == slot) && use.carries(e.frame.id);
    };
    for (std::size_t k = 1; k <= use.ids.size(); ++k) {  // identifiers that share a slot take turns
        const auto index = (last_index_[slot] + k) % use.ids.size();
        SendQueue::Entry* e = queue_.next([&](const SendQueue::Entry& one) {
            return one.frame.id == use.ids[index] && fits(one);
        });
        if (e == nullptr) continue;
        last_index_[slot] = static_cast<std::uint8_t>(index);
        return e;
    }
    return queue_.next(fits);
}

/// In a thread slower than the turns of a slot, the newest value is sent again in each of them. A
/// bridge sends each frame of its participant once.
SendQueue::Entry* Station::repeated(const Use& use, std::uint32_t slot) noexcept {
    if (role_ == Role::bridge) return nullptr;
    for (std::size_t k = 1; k <= use.ids.size(); ++k) {
        const auto index = (last_index_[slot] + k) % use.ids.size();
        const SendQueue::Entry* before = queue_.handed_over(use.ids[index], now_);
        if (before == nullptr || (before->slot != no_slot && before->slot != slot)) continue;
        const can::Frame frame = before->frame;
        if (!queue_.push(frame, before->slot, true, true)) {
            ++count_.missed;
            return nullptr;
        }
        last_index_[slot] = static_cast<std::uint8_t>(index);
        return queue_.next(
            [&](const SendQueue::Entry& e) { return e.priv && e.state && e.frame.id == frame.id; });
    }
    return nullptr;
}

void Station::plan(std::uint64_t cycle, std::uint32_t slot, Time begin) noexcept {
    if (slot == 0) {
        if (is_sync_node()) {
            plan_sync(cycle);
        }
        return;
    }
    if (!may_send(cycle)) return;
    const Use* use = table_.use(mode_of(cycle), slot, counter_of(cycle));
    if (!numbered_ && (use == nullptr || use->every > 1)) {
        return;  // the slot may be private
    }
    if (use == nullptr || use->kind == Kind::shared) {
        return plan_shared(begin, {.not_before_ns = begin});
    }
    if (use->node == node_) {
        SendQueue::Entry* e = next_private(*use, slot);
        if (e == nullptr) {
            e = repeated(*use, slot);
        }
        if (e != nullptr) {
            const Time last =
                begin + (single_shot_ ? table_.enabled() : table_.last_start(e->frame.length));
            e->in_flight =
                emit(e->frame,
                     {.not_before_ns = begin, .last_start_ns = last, .single_shot = single_shot_});
            e->until = begin + table_.slot() - table_.guard;
            e->planned = now_;
            return;
        }
    }
    const Time idle_from = begin - table_.guard / 2;

    const Time idle_until = begin + table_.idle - table_.bits(1);
    if (role_ == Role::monitor) {
        const Time at = begin + table_.idle;
        emit(announcement(slot),
             {at, at + table_.guard - table_.bits(1), idle_from, idle_until, true});
        return;
    }
    if (senses_) {
        plan_shared(begin, {.not_before_ns = begin + table_.idle + table_.guard,
                            .idle_from_ns = idle_from,
                            .idle_until_ns = idle_until});
    }
}

/// Hands over the shared frames that may fit into a slot, from the begin of the window on. The
/// controller discards those that do not start in time; they wait for the next slot.
void Station::plan_shared(Time begin, const can::Window& window) noexcept {
    Time from = window.not_before_ns;
    for (;;) {
        SendQueue::Entry* e = queue_.next([&](const SendQueue::Entry& entry) {
            return !entry.priv && from <= begin + table_.last_start(entry.frame.length);
        });
        if (e == nullptr) return;
        can::Window w = window;
        w.last_start_ns = begin + table_.last_start(e->frame.length);
        e->in_flight = emit(e->frame, w);
        if (!e->in_flight) return;
        e->until = begin + table_.slot() - table_.guard;
        from += table_.bits(can::frame_bits(e->frame).nominal);
    }
}

/// Uses the rest of a slot that the monitor has announced as idle.
void Station::recycle_announced(Time now) noexcept {
    if (announced_slot_ == no_slot) return;
    const Where w = where(now);
    if (w.cycle == announced_cycle_ && w.slot == announced_slot_ && may_send(w.cycle)) {
        plan_shared(begin_of(w.cycle, w.slot), {.not_before_ns = now});
    }
    announced_slot_ = no_slot;
}

/// Without transmit windows: counts the turns of own slots that passed since the last call without
/// a cycle of the thread in their window, although a value was there.
void Station::count_turns(Time now, Time period) noexcept {
    Time next = begin_of(next_cycle_, next_slot_);
    // the first call, or the clock has jumped
    if (next < now - 2 * period - table_.cycle || next > now + table_.cycle) {
        const Where w = where(now);
        next_cycle_ = w.cycle;
        next_slot_ = w.slot;
        next = begin_of(next_cycle_, next_slot_);
    }
    for (; next + table_.enabled() < now; next = begin_of(next_cycle_, next_slot_)) {
        const Use* use = may_send(next_cycle_)
                             ? table_.use(mode_of(next_cycle_), next_slot_, counter_of(next_cycle_))
                             : nullptr;
        const bool used = used_cycle_ == next_cycle_ && used_slot_ == next_slot_;
        if (use != nullptr && numbered_ && !used && use->kind == Kind::priv && use->node == node_) {
            for (const std::uint32_t id : use->ids) {
                const Value& v = values_[id];
                if (v.last != now_ || crystal_.local(v.since) > next) continue;
                ++count_.missed;
                if (period > table_.enabled()) {
                    raise(Event::slot_missed, static_cast<std::uint32_t>(node_), id, period);
                }
                break;
            }
        }
        if (++next_slot_ == table_.slots) {
            next_slot_ = 0;
            ++next_cycle_;
        }
    }
}

/// Without transmit windows: sends what may start now, one frame at a time.
void Station::start_now(Time now) noexcept {
    const Where w = where(now);
    if (!w.known) return;
    if (w.slot == 0) {
        if (is_sync_node()) {
            plan_sync(w.cycle);
        }
        return;
    }
    if (!may_send(w.cycle) || queue_.flying()) return;
    const Use* use = table_.use(mode_of(w.cycle), w.slot, w.counter);
    if (!numbered_ && (use == nullptr || use->every > 1)) return;
    const bool is_shared = use == nullptr || use->kind == Kind::shared;
    const bool used = used_cycle_ == w.cycle && used_slot_ == w.slot;
    SendQueue::Entry* e = nullptr;
    bool in_own_window = false;
    if (!is_shared && use->node == node_ && !used && w.offset <= table_.enabled()) {
        e = next_private(*use, w.slot);
        in_own_window = e != nullptr;
    }
    const bool was_idle = last_begin_ < begin_of(w.cycle, w.slot) - table_.guard;
    if (!is_shared && role_ == Role::monitor && !used && was_idle && w.offset >= table_.idle) {
        used_cycle_ = w.cycle;
        used_slot_ = w.slot;
        emit(announcement(w.slot), {});
        return;
    }
    const bool recycles = senses_ ? was_idle && w.offset >= table_.idle + table_.guard
                                  : announced_cycle_ == w.cycle && announced_slot_ == w.slot;
    if (e == nullptr && (is_shared || used || recycles)) {
        e = queue_.next([&](const SendQueue::Entry& entry) {
            return !entry.priv && w.offset <= table_.last_start(entry.frame.length);
        });
    }
    if (e == nullptr || (used && in_own_window)) return;
    e->in_flight = emit(e->frame, {});
    e->until = begin_of(w.cycle, w.slot) + table_.slot();
    used_cycle_ = w.cycle;
    used_slot_ = w.slot;
}

/// Hands a frame to the link; the window is in this node's time.
bool Station::emit(const can::Frame& frame, can::Window w) noexcept {
    if (!windows_) return link_->send(frame, now_) == can::Sent::queued;
    w.not_before_ns = crystal_.bus(w.not_before_ns);
    if (w.last_start_ns != INT64_MAX) {
        w.last_start_ns = crystal_.bus(w.last_start_ns);
    }
    if (w.idle_from_ns != w.idle_until_ns) {
        w.idle_from_ns = crystal_.bus(w.idle_from_ns);

        w.idle_until_ns = crystal_.bus(w.idle_until_ns);
    }
    return link_->send_within(frame, w, now_) == can::Sent::queued;
}

}  // namespace hal::scocan
