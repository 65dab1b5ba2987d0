// SPDX-License-Identifier: MIT
// Frames outside of their slots, own and others', and the slots that nobody used.
#include "station.hpp"

namespace hal::scocan {

namespace {
constexpr std::uint32_t babbling_frames = 5;     // outside of their slots in one cycle
constexpr std::uint32_t most_offences = 3;       // in a second, until a node silences itself
constexpr Time offence_window = 1'000'000'000;
// without announcements until the monitor counts as lost
constexpr std::uint32_t monitor_cycles = 10;
}  // namespace

std::uint32_t Station::owner_of(std::uint32_t id) const noexcept {
    if (const Use* use = table_.owner(mode_, id)) return static_cast<std::uint32_t>(use->node);
    if (const Message* m = table_.message(id)) return static_cast<std::uint32_t>(m->node);
    for (const Mode& mode : table_.modes) {
        if (const Use* use = table_.owner(mode.number, id)) {
            return static_cast<std::uint32_t>(use->node);
        }
    }
    return no_node;
}

bool Station::is_foreign(const can::Frame& frame, const Where& w) const noexcept {
    if (w.slot == 0) return true;
    const std::uint32_t mode = mode_of(w.cycle);
    const Use* use = table_.use(mode, w.slot, w.counter);
    const Use* owner = table_.owner(mode, frame.id);
    if (use != nullptr && use->kind == Kind::priv) {
        if (use->carries(frame.id) && (owner == nullptr || owner->node == use->node)) return false;
        if (frame.id == announce_id) return false;
        if (w.offset < table_.idle - table_.bits(1)) {
            return true;  // the owner's window
        }
    }
    return owner != nullptr || frame.id < 0x10;
}

/// Checks a frame of another node.
void Station::watch(const can::Frame& frame, const Where& w, Time) noexcept {
    if (!w.known || state_ != State::running || clock_.lost() > 0 || !numbered_) return;
    if (frame.id != announce_id) {
        seen_[w.slot] = true;
    }
    if (!is_foreign(frame, w)) return;
    ++count_.foreign;
    ++foreign_[frame.id & 0x7ff];
    foreign_id_ = frame.id;
    ++foreign_in_cycle_;
    raise(Event::foreign_frame, owner_of(frame.id), frame.id, w.slot);
}

/// Counts an own frame outside of its slot; too many of them silence the node.
void Station::offend(Time begin) noexcept {
    if (offences_ == 0 || begin - first_offence_ > offence_window) {
        offences_ = 0;
        first_offence_ = begin;
    }
    if (++offences_ < most_offences || silenced_) return;
    silenced_ = true;
    raise(Event::silenced, static_cast<std::uint32_t>(node_));
}

void Station::reset() noexcept {
    silenced_ = false;
    offences_ = 0;
    standby_ = false;
    babbled_ = false;
}

/// Ends the account of a cycle.
void Station::close_cycle() noexcept {
    const bool babbles = foreign_in_cycle_ >= babbling_frames;
    if (babbles && !babbled_) {
        raise(Event::babbling, owner_of(foreign_id_), foreign_id_, foreign_in_cycle_);
    }
    babbled_ = babbles;
    foreign_in_cycle_ = 0;
    std::uint32_t unannounced = 0;
    const Mode* mode = table_.mode(mode_);
    const std::uint32_t counter = (counter_ + counter_cycles - 1) % counter_cycles;
    for (std::uint32_t slot = 0; mode != nullptr && slot < table_.slots; ++slot) {
        const Use* use = table_.use(mode_, slot, counter);
        if (use != nullptr && use->kind == Kind::priv && use->node != node_ &&
            (told_[slot] || !seen_[slot])) {
            ++count_.idle;
            if (!told_[slot]) {
                ++unannounced;
            }
        }
        told_[slot] = seen_[slot] = false;
    }
    if (role_ == Role::monitor || !monitored_ || clock_.lost() > 0 || state_ != State::running) {
        return;
    }
    unannounced_cycles_ = unannounced > 0 ? unannounced_cycles_ + 1 : 0;
    if (unannounced_cycles_ < monitor_cycles) return;
    monitored_ = false;
    monitor_lost_ = true;
    raise(Event::monitor_lost);
}

}  // namespace hal::scocan
