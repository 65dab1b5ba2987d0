// SPDX-License-Identifier: MIT
// The SYNC: its primary sender listens before it leads; backup k sends k offsets behind the begin
// of a cycle in which no SYNC came.
#include "station.hpp"

namespace hal::scocan {

namespace {
constexpr std::uint32_t listen_cycles = 3;
constexpr std::uint32_t takeover_every = 8;
}  // namespace

/// Decides whether this node begins to send the SYNC.
void Station::lead(Time now) noexcept {
    // A primary that does not hear the other one any more, whose table differed, leads with its
    // own.
    if (role_ == Role::sync && clock_.known() && clock_.lost() >= listen_cycles) {
        listen_only_ = false;
    }
    if (leading_ || listen_only_) return;
    if (!clock_.known()) {
        if (now - first_seen_ < table_.cycle * (listen_cycles + backup_)) return;
        // another node has just begun
        if (clock_.heard() && now - clock_.start() < table_.cycle * listen_cycles) return;
        clock_.lead(now);
        counter_ = 0;
        numbered_ = true;
        next_cycle_ = 0;
        next_slot_ = 0;
        set_leading(true);
        judge(now);
    } else if (role_ == Role::sync && clock_.lost() >= listen_cycles) {
        standby_ = false;
        numbered_ = true;
        set_leading(true);
    }
}

void Station::set_leading(bool leads) noexcept {
    if (leading_ == leads) return;
    leading_ = leads;
    raise(leads ? Event::leading : Event::standby, static_cast<std::uint32_t>(node_));
    if (leads) {
        announce_table();
    }
}

/// Returns true when the returned primary takes the SYNC over from a backup in that cycle.
bool Station::takes_over(std::uint64_t cycle) noexcept {
    if (role_ != Role::sync || standby_ || !numbered_ || leader_ == 0 ||
        counter_of(cycle) % takeover_every != 0) {
        return false;
    }
    if (begin_of(cycle, 0) - first_seen_ < table_.cycle * listen_cycles) return false;
    set_leading(true);
    return true;
}

can::Frame Station::sync_frame(std::uint64_t cycle) const noexcept {
    const bool pending = change_.agreed && cycle < change_.at;
    return encode(Sync{true, static_cast<std::uint8_t>(counter_of(cycle)),
                       static_cast<std::uint8_t>(mode_of(cycle)),
                       static_cast<std::uint8_t>(backup_), pending});
}

void Station::plan_sync(std::uint64_t cycle) noexcept {
    if (state_ == State::down || state_ == State::silenced || listen_only_) return;
    const Time begin = begin_of(cycle, 0);
    const Time at = begin + table_.sync_offset(backup_);
    const bool primary = role_ == Role::sync;
    if (primary && !leading_ && !takes_over(cycle)) return;
    if (!windows_) {
        const bool used = used_cycle_ == cycle && used_slot_ == 0;
        const Time now = crystal_.local(now_);
        if (used || now < at - table_.guard ||
            (!primary && clock_.cycle() == cycle && clock_.seen())) {
            return;
        }
        if (now > begin + table_.last_start(2)) return;
        used_cycle_ = cycle;
        used_slot_ = 0;
        emit(sync_frame(cycle), {});
        return;
    }
    if (primary) {
        const Time last = begin + (single_shot_ ? table_.enabled() : table_.last_start(2));
        emit(sync_frame(cycle),
             {.not_before_ns = begin, .last_start_ns = last, .single_shot = single_shot_});
    } else {
        emit(sync_frame(cycle),
             {at, at + table_.guard, begin - table_.guard, at - table_.bits(1), true});
    }
}

/// Handles the echo of an own SYNC.
void Station::sync_sent(Time begin) noexcept {
    const std::uint64_t before = clock_.cycle();
    clock_.own(begin - table_.sync_offset(backup_));
    const auto passed = clock_.cycle() - before;
    counter_ = static_cast<std::uint32_t>(counter_ + passed) % counter_cycles;
    ++count_.syncs;
    numbered_ = true;
    leader_ = backup_;
    set_leading(true);
    if (passed == 0) return;
    close_cycle();
    switch_mode();
    change_cycle();
    if (counter_ == 0) {
        announce_table();
    }
}

/// Handles the SYNC of another node, if this one may send it too.
void Station::other_sync(const Sync& s) noexcept {
    if (!leading_) return;
    if (role_ == Role::backup) {
        if (s.sender == backup_) {
            raise(Event::other_sync, s.sender);
        }
        if (s.sender <= backup_) {
            change_ = {};
            set_leading(false);
        }
        return;
    }
    if (s.sender != 0) {
        return;  // a backup, because the SYNC of this node was disturbed
    }
    raise(Event::other_sync, s.sender);
    standby_ = true;
    change_ = {};
    set_leading(false);
    clock_.clear();
}

/// Sends the CRC of the table to all nodes.
void Station::announce_table() noexcept {
    queue_.push(encode(Request{Request::What::table, 0, table_.crc, 0}), no_slot, false, true);
}

}  // namespace hal::scocan
