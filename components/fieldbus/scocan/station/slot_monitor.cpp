// SPDX-License-Identifier: MIT
#include "fieldbus/scocan/station/slot_monitor.hpp"

namespace hal::scocan {

namespace {
constexpr std::uint32_t babbling_frames = 5;     // outside of their slots in one cycle
constexpr std::uint32_t max_offences = 3;        // in a second, until a node silences itself
constexpr Time offence_window = 1'000'000'000;
// without announcements until the monitor counts as lost
constexpr std::uint32_t monitor_cycles = 10;
}  // namespace

void SlotMonitor::attach() noexcept {
    monitor_lost_ = false;
    offences_ = 0;
}

void SlotMonitor::forget() noexcept {
    monitored_ = false;
    unannounced_cycles_ = 0;
}

void SlotMonitor::reset() noexcept {
    offences_ = 0;
    babbled_ = false;
}

std::uint32_t SlotMonitor::owner_of(std::uint32_t id) const noexcept {
    const Table& table = core_.table;
    if (const Use* use = table.owner(modes_.mode(), id)) {
        return static_cast<std::uint32_t>(use->node);
    }
    if (const Message* m = table.message(id)) return static_cast<std::uint32_t>(m->node);
    for (const Mode& mode : table.modes) {
        if (const Use* use = table.owner(mode.number, id)) {
            return static_cast<std::uint32_t>(use->node);
        }
    }
    return no_node;
}

const Use* SlotMonitor::use_at(const SlotTime& w) const noexcept {
    return core_.table.use(modes_.of(w.at.cycle), w.at.slot, w.counter);
}

bool SlotMonitor::is_foreign(const can::Frame& frame, const SlotTime& w) const noexcept {
    if (w.at.slot == 0) return true;
    const Use* use = use_at(w);
    const Use* owner = core_.table.owner(modes_.of(w.at.cycle), frame.id);
    if (use != nullptr && use->kind == Kind::priv) {
        if (use->carries(frame.id) && (owner == nullptr || owner->node == use->node)) return false;
        if (frame.id == announce_id) return false;
        const bool in_owners_window = w.offset < core_.table.idle - core_.table.bits(1);
        if (in_owners_window) return true;
    }
    return owner != nullptr || frame.id < 0x10;
}

void SlotMonitor::check(const can::Frame& frame, const SlotTime& w) noexcept {
    if (!w.known || core_.state != State::running || core_.clock.lost() > 0 || !core_.numbered) {
        return;
    }
    if (frame.id != announce_id) {
        seen_[w.at.slot] = true;
    }
    if (!is_foreign(frame, w)) return;
    ++core_.count.foreign;
    ++foreign_[frame.id & 0x7ff];
    foreign_id_ = frame.id;
    ++foreign_in_cycle_;
    core_.raise(Event::foreign_frame, owner_of(frame.id), frame.id, w.at.slot);
}

void SlotMonitor::check_own(const can::Frame& frame, const SlotTime& w, Time bus_begin) noexcept {
    if (w.known) {
        seen_[w.at.slot] = true;
    }
    const Use* use = w.known ? use_at(w) : nullptr;
    const bool in_own = use != nullptr && use->kind == Kind::priv && use->node == core_.node;
    if (use == nullptr || use->kind == Kind::shared) {
        ++core_.count.sent_shared;
    } else if (in_own) {
        ++core_.count.sent_private;
    } else {
        ++core_.count.sent_recycled;
    }
    if (!w.known || core_.state != State::running) return;
    const bool mine = in_own && use->carries(frame.id);
    const Time late = w.offset - core_.table.enabled() - core_.table.guard;
    if (mine && late > 0 && core_.single_shot) {
        offend(Event::late_frame, frame, late, bus_begin);
    } else if (!mine && is_foreign(frame, w)) {
        offend(Event::foreign_frame, frame, w.at.slot, bus_begin);
    }
}

/// Counts an own frame outside of its slot; too many of them silence the node.
void SlotMonitor::offend(Event event, const can::Frame& frame, Time value,
                         Time bus_begin) noexcept {
    ++core_.count.late;
    core_.raise(event, core_.node, frame.id, value);
    const Time begin = core_.crystal.local(bus_begin);
    if (offences_ == 0 || begin - first_offence_ > offence_window) {
        offences_ = 0;
        first_offence_ = begin;
    }
    if (++offences_ < max_offences || core_.silenced) return;
    core_.silenced = true;
    core_.raise(Event::silenced, core_.node);
}

void SlotMonitor::announced(const SlotTime& w) noexcept {
    ++core_.count.announced;
    if (w.at.slot < announced_.size()) {
        announced_[w.at.slot] = true;
    }
}

void SlotMonitor::monitor_heard() noexcept {
    if (monitor_lost_) {
        core_.raise(Event::monitor_found);
    }
    monitored_ = true;
    monitor_lost_ = false;
    unannounced_cycles_ = 0;
}

/// Counts the private slots of others without a frame. Returns those without an announcement.
std::uint32_t SlotMonitor::count_idle() noexcept {
    const Table& table = core_.table;
    const std::uint32_t mode = modes_.mode();
    if (table.mode(mode) == nullptr) return 0;
    const std::uint32_t counter = (core_.counter + counter_cycles - 1) % counter_cycles;
    std::uint32_t unannounced = 0;
    for (std::uint32_t slot = 0; slot < table.slots; ++slot) {
        const Use* use = table.use(mode, slot, counter);
        const bool of_other = use != nullptr && use->kind == Kind::priv && use->node != core_.node;
        if (of_other && (announced_[slot] || !seen_[slot])) {
            ++core_.count.idle;
            unannounced += announced_[slot] ? 0 : 1;
        }
        announced_[slot] = seen_[slot] = false;
    }
    return unannounced;
}

void SlotMonitor::close_cycle() noexcept {
    const bool babbles = foreign_in_cycle_ >= babbling_frames;
    if (babbles && !babbled_) {
        core_.raise(Event::babbling, owner_of(foreign_id_), foreign_id_, foreign_in_cycle_);
    }
    babbled_ = babbles;
    foreign_in_cycle_ = 0;
    const std::uint32_t unannounced = count_idle();
    if (core_.role == Role::monitor || !monitored_ || core_.clock.lost() > 0 ||
        core_.state != State::running) {
        return;
    }
    unannounced_cycles_ = unannounced > 0 ? unannounced_cycles_ + 1 : 0;
    if (unannounced_cycles_ < monitor_cycles) return;
    monitored_ = false;
    monitor_lost_ = true;
    core_.raise(Event::monitor_lost);
}

}  // namespace hal::scocan
