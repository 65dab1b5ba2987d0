// SPDX-License-Identifier: MIT
#include "fieldbus/scocan/station/sync_sender.hpp"

namespace hal::scocan {

namespace {
constexpr std::uint32_t listen_cycles = 3;
constexpr std::uint32_t takeover_every = 8;
}  // namespace

void SyncSender::forget() noexcept {
    standby_ = false;
    leader_ = no_node;
}

bool SyncSender::listened_long_enough(Time now) const noexcept {
    const Time cycle = core_.table.cycle;
    if (now - core_.first_seen < cycle * (listen_cycles + core_.backup)) return false;
    // another node has just begun
    return !core_.clock.heard() || now - core_.clock.start() >= cycle * listen_cycles;
}

bool SyncSender::lead(Time now) noexcept {
    const bool known = core_.clock.known();
    const bool primary_alone =
        core_.role == Role::sync && known && core_.clock.lost() >= listen_cycles;
    // A primary that does not hear the other one any more, whose table differed, leads with its
    // own.
    if (primary_alone) {
        core_.listen_only = false;
    }
    if (core_.leading || core_.listen_only) return false;
    if (primary_alone) {
        standby_ = false;
        core_.numbered = true;
        set_leading(true);
    }
    if (known || !listened_long_enough(now)) return false;
    core_.clock.lead(now);
    core_.counter = 0;
    core_.numbered = true;
    set_leading(true);
    return true;
}

void SyncSender::set_leading(bool leads) noexcept {
    if (core_.leading == leads) return;
    core_.leading = leads;
    core_.raise(leads ? Event::leading : Event::standby, core_.node);
    if (leads) {
        announce_table();
    }
}

/// Returns true when the returned primary takes the SYNC over from a backup in that cycle.
bool SyncSender::takes_over(std::uint64_t cycle) noexcept {
    if (core_.role != Role::sync || standby_ || !core_.numbered || leader_ == 0) return false;
    if (core_.counter_of(cycle) % takeover_every != 0) return false;
    const Time listened = core_.begin_of({cycle, 0}) - core_.first_seen;
    if (listened < core_.table.cycle * listen_cycles) return false;
    set_leading(true);
    return true;
}

can::Frame SyncSender::frame_of(std::uint64_t cycle) const noexcept {
    return encode(Sync{true, static_cast<std::uint8_t>(core_.counter_of(cycle)),
                       static_cast<std::uint8_t>(modes_.of(cycle)),
                       static_cast<std::uint8_t>(core_.backup), modes_.announces(cycle)});
}

void SyncSender::plan(std::uint64_t cycle) noexcept {
    if (!core_.is_sync_node()) return;
    if (core_.state == State::down || core_.state == State::silenced || core_.listen_only) return;
    const Table& table = core_.table;
    const bool primary = core_.role == Role::sync;
    if (primary && !core_.leading && !takes_over(cycle)) return;
    const Time begin = core_.begin_of({cycle, 0});
    const Time at = begin + table.sync_offset(core_.backup);
    if (!core_.windows) return send_at_once(cycle, begin, at);
    if (primary) {
        const Time window = core_.single_shot ? table.enabled() : table.last_start(2);
        core_.send(frame_of(cycle), {.not_before_ns = begin,
                                     .last_start_ns = begin + window,
                                     .single_shot = core_.single_shot});
    } else {
        core_.send(frame_of(cycle),
                   {at, at + table.guard, begin - table.guard, at - table.bits(1), true});
    }
}

/// Without transmit windows: sends the SYNC when it is due in this call.
void SyncSender::send_at_once(std::uint64_t cycle, Time begin, Time at) noexcept {
    const SlotIndex slot{cycle, 0};
    const Time now = core_.crystal.local(core_.now);
    if (core_.used == slot || now < at - core_.table.guard) return;
    const bool came = core_.clock.cycle() == cycle && core_.clock.seen();
    if (core_.role != Role::sync && came) return;
    if (now > begin + core_.table.last_start(2)) return;
    core_.used = slot;
    core_.send(frame_of(cycle), {});
}

std::uint64_t SyncSender::sent(Time begin) noexcept {
    const std::uint64_t before = core_.clock.cycle();
    core_.clock.own(begin - core_.table.sync_offset(core_.backup));
    const auto passed = core_.clock.cycle() - before;
    core_.counter = static_cast<std::uint32_t>(core_.counter + passed) % counter_cycles;
    ++core_.count.syncs;
    core_.numbered = true;
    leader_ = core_.backup;
    set_leading(true);
    return passed;
}

void SyncSender::other_sent(const Sync& s) noexcept {
    if (!core_.leading) return;
    if (core_.role == Role::backup) {
        if (s.sender == core_.backup) {
            core_.raise(Event::other_sync, s.sender);
        }
        if (s.sender <= core_.backup) {
            modes_.cancel();
            set_leading(false);
        }
        return;
    }
    if (s.sender != 0) return;  // a backup, because the SYNC of this node was disturbed
    core_.raise(Event::other_sync, s.sender);
    standby_ = true;
    modes_.cancel();
    set_leading(false);
    core_.clock.clear();
}

void SyncSender::announce_table() noexcept {
    core_.send_shared(encode(Request{core_.node, Request::What::table, 0, core_.table.crc, 0}),
                      true);
}

}  // namespace hal::scocan
