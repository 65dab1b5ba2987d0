// SPDX-License-Identifier: MIT
#include "transmitter.hpp"

#include <algorithm>
#include <utility>

namespace hal::tdma {

void Transmitter::set_up() {
    const StationSetup& setup = core_.setup;
    for (const SlotSetup& s : setup.slots) {
        slots_.emplace_back(s, setup.queue);
    }
    while (slots_.size() < std::min(setup.slot_capacity, max_slots)) {
        slots_.emplace_back(SlotSetup{.id = unused_slot, .size = 0}, setup.queue);
    }
}

bool Transmitter::change(std::span<const SlotSetup> setups) noexcept {
    if (setups.size() > slots_.size()) return false;
    for (std::size_t i = 0; i < slots_.size(); ++i) {
        slots_[i].change(i < setups.size() ? setups[i] : SlotSetup{.id = unused_slot, .size = 0});
    }
    clear_slots();
    return true;
}

void Transmitter::restart() noexcept {
    for (Reply& reply : replies_) {
        reply.used = false;
    }
    sent_any_ = false;
    recalibration_ = 0;
}

void Transmitter::clear_slots() noexcept {
    const std::uint32_t epoch = epoch_.load(std::memory_order_relaxed) + 1;
    epoch_.store(epoch, std::memory_order_release);
    for (Slot& s : slots_) {
        s.clear(epoch);
        core_.status.count.cleared += s.take_dropped();
    }
}

const Slot* Transmitter::find(unsigned id) const noexcept {
    for (const Slot& s : slots_) {
        if (s.id() == id) return &s;
    }
    if (id == tunnel_slot) return find(default_slot);
    return nullptr;
}

Transmitter::Target Transmitter::target(unsigned id) noexcept {
    const std::uint32_t epoch = epoch_.load(std::memory_order_acquire);
    return {epoch, const_cast<Slot*>(find(id))};
}

/// Returns the entry of a station, a free one, or nullptr.
Transmitter::Reply* Transmitter::reply_to(const Address& station) noexcept {
    const auto of_station = [&](const Reply& r) { return r.used && r.to == station; };
    auto found = std::find_if(replies_.begin(), replies_.end(), of_station);
    if (found == replies_.end()) {
        found =
            std::find_if(replies_.begin(), replies_.end(), [](const Reply& r) { return !r.used; });
    }
    return found == replies_.end() ? nullptr : &*found;
}

void Transmitter::queue_reply(const Decoded& d, Time arrived) noexcept {
    const Request& r = d.request;
    const auto ahead = static_cast<std::int32_t>(r.reply_cycle - core_.grid.number);
    const bool in_cycle = r.reply_offset >= 0 && r.reply_offset < core_.setup.cycle;
    Reply* reply = in_cycle && ahead >= 0 && ahead <= 100'000 ? reply_to(d.from) : nullptr;
    if (reply == nullptr) {
        ++core_.status.count.too_late;
        return;
    }
    *reply = {d.from, r.stamp, core_.clock.global(arrived), r.reply_offset, r.reply_cycle, true};
}

bool Transmitter::launch(std::span<const std::uint8_t> frame,
                         const ethernet::Launch& how) noexcept {
    return core_.port->send(frame, how, local_now()) == ethernet::Sent::queued;
}

void Transmitter::send_sync(std::uint32_t cycle, Time global_at) noexcept {
    const Time at = core_.clock.local(global_at);
    const Frame frame = encode(core_.address, Sync{cycle, global_at, core_.start_of(cycle)});
    // The port stamps the frame when it leaves; stamp_add_ns converts to global time.
    if (launch(frame, {.at_ns = at,
                       .guard_ns = core_.setup.cycle / 2,
                       .stamp_at = sync_stamp_at,
                       .stamp_add_ns = global_at - at})) {
        ++core_.status.count.syncs_sent;
    }
}

void Transmitter::send_replies() noexcept {
    for (Reply& reply : replies_) {
        if (!reply.used) continue;
        const Time global_at = core_.start_of(reply.cycle) + reply.offset;
        const Time at = core_.clock.local(global_at);
        if (at > local_now() + reach()) continue;  // not in this turn
        reply.used = false;
        if (at <= local_now()) {
            ++core_.status.count.too_late;
            continue;
        }
        const Frame frame =
            encode(reply.to, core_.address, tdma::Reply{reply.stamp, reply.received, global_at});
        if (launch(frame, {.at_ns = at,
                           .guard_ns = core_.setup.guard,
                           .stamp_at = reply_stamp_at,
                           .stamp_add_ns = global_at - at})) {
            ++core_.status.count.served;
        }
    }
}

void Transmitter::send_request(const Slot& slot, std::uint32_t cycle, Time local_at) noexcept {
    // RTnet's stations give the master one period of the slot for its answer. That is too short for
    // an early slot when the master's thread runs later, so the reply is at least two cycles later.
    const std::uint32_t period = slot.setup().period;
    const Time offset = slot.setup().offset;
    const std::uint32_t reply_cycle = cycle + period * std::max(1U, (2 + period - 1) / period);
    const Frame frame =
        encode(core_.status.master, core_.address, Request{local_at, reply_cycle, offset});
    calibration_.sent(reply_cycle, local_at,
                      core_.clock.local(core_.start_of(reply_cycle) + offset));
    ++core_.status.count.requests;
    launch(frame, {.at_ns = local_at,
                   .guard_ns = core_.setup.guard,
                   .stamp_at = request_stamp_at,
                   .stamp_add_ns = 0});
}

/// Uses a turn of the first slot for the calibration. Returns false when it does not.
bool Transmitter::calibrates(const Slot& slot, std::uint32_t cycle, Time local_at) noexcept {
    if (!calibration_.active() || core_.status.leading) return false;
    if (calibration_.reserved(cycle)) return true;  // for the master's reply
    const std::uint32_t period = slot.setup().period;
    const bool turn = core_.status.state == State::calibrating || recalibration_ == 0 ||
                      cycle / period % recalibration_ == 0;
    if (!turn || !calibration_.due(cycle, period)) return false;
    send_request(slot, cycle, local_at);
    return true;
}

/// Takes the next frame of a slot. Returns false when the slot is empty, when the frame needs more
/// than `space` bytes on the line, and while another thread has the queues.
bool Transmitter::take(Slot& slot, std::size_t space) noexcept {
    const link::OrderedCall call(core_.order, link::OrderedCall::Wait::bounded);
    if (!call.is_made() || core_.has_stale_frames) return false;
    const std::span frame = slot.front();
    if (frame.empty() || ethernet::wire_bytes(frame.size()) > space) return false;
    std::copy(frame.begin(), frame.end(), outgoing_.bytes.begin());
    outgoing_.length = frame.size();
    outgoing_.finisher = slot.finisher();
    slot.pop();
    return true;
}

void Transmitter::send_slot(std::size_t index, std::uint32_t cycle) noexcept {
    Slot& slot = slots_[index];
    const Time at = core_.clock.local(core_.start_of(cycle) + slot.setup().offset);
    if (index == 0 && calibrates(slot, cycle, at)) return;
    if (core_.status.state != State::running) return;
    std::size_t used = 0;
    while (take(slot, slot.turn_bytes() - used)) {
        const std::span frame(outgoing_.bytes.data(), outgoing_.length);
        if (launch(frame, {.at_ns = at + core_.wire_time(used),
                           .guard_ns = core_.setup.guard,
                           .finisher = outgoing_.finisher})) {
            ++core_.status.count.sent;
        }
        used += ethernet::wire_bytes(frame.size());
    }
    core_.status.count.cleared += slot.take_dropped();
    send_pings(slot, at, used);
}

/// Uses the time that real-time frames leave in a turn.
void Transmitter::send_pings(const Slot& slot, Time local_at, std::size_t used) noexcept {
    constexpr std::size_t bytes = ethernet::wire_bytes(ethernet::smallest_frame);
    while (used + bytes <= slot.turn_bytes()) {
        const Time at = local_at + core_.wire_time(used);
        if (!send_answer(at) && !send_ping(at)) return;
        used += bytes;
    }
}

/// Sends the oldest pending ping response. Returns false when no response is pending.
bool Transmitter::send_answer(Time local_at) noexcept {
    const Pings::Owed* owed = pings_.answer();
    if (owed == nullptr) return false;
    const Frame frame = encode(owed->to, core_.address,
                               Echo{owed->ping_stamp, owed->received, local_at, owed->number});
    if (launch(frame, {.at_ns = local_at,
                       .guard_ns = core_.setup.guard,
                       .stamp_at = echo_stamp_at,
                       .stamp_add_ns = 0})) {
        ++core_.status.count.sent;
    }
    pings_.pop_answer();
    return true;
}

Address Transmitter::ping_target(std::size_t n) const noexcept {
    const auto& others = core_.setup.others;
    if (n >= others.size()) return core_.status.master;
    return roster_[n].from != Address{} ? roster_[n].from : others[n].mac;
}

/// Sends the next ping to a station with a known address. Returns false when no ping is due, or
/// when it could not be sent; then it is tried again.
bool Transmitter::send_ping(Time local_at) noexcept {
    for (std::size_t n = pings_.waiting(); n != pings_.size(); n = pings_.waiting()) {
        const Address to = ping_target(n);
        if (to == Address{}) {
            pings_.fail(n, Outcome::no_address);
            continue;
        }
        const Frame frame = encode(to, core_.address, Ping{local_at, pings_[n].number});
        if (!launch(frame, {.at_ns = local_at,
                            .guard_ns = core_.setup.guard,
                            .stamp_at = ping_stamp_at,
                            .stamp_add_ns = 0})) {
            return false;
        }
        ++core_.status.count.sent;
        pings_.sent(n, to, local_at);
        return true;
    }
    return false;
}

/// Returns the syncs and slots in a time, in order; the sync first of those at the same time.
std::span<Transmitter::Turn> Transmitter::due_turns(std::array<Turn, max_turns>& turns, Time from,
                                                    Time until) const noexcept {
    std::size_t count = 0;
    const std::uint32_t number = core_.grid.number;
    const bool sends_syncs = core_.status.leading && core_.setup.role == Role::master;
    const std::size_t sync = slots_.size();
    for (std::uint32_t c = number - 1; static_cast<std::int32_t>(c - number) <= 2; ++c) {
        const auto add = [&](Time at, std::size_t index) {
            if (at > from && at <= until) {
                turns[count++] = {at, index, c};
            }
        };
        const Time start = core_.start_of(c);
        if (sends_syncs) {
            add(start, sync);
        }
        for (std::size_t i = 0; i < slots_.size(); ++i) {
            if (slots_[i].used_in(c)) {
                add(start + slots_[i].setup().offset, i);
            }
        }
    }
    const std::span<Turn> due{turns.data(), count};
    std::sort(due.begin(), due.end(), [sync](const Turn& a, const Turn& b) {
        if (a.at != b.at) return a.at < b.at;
        return (a.index == sync) > (b.index == sync);
    });
    return due;
}

void Transmitter::transmit(Time now, bool backup_sync) noexcept {
    const Time here = core_.clock.global(now);
    const Time until = here + reach();
    // A slot has its turn once, whatever the thread's clock was stepped by; what lies behind the
    // thread is lost.
    const bool continues =
        sent_any_ && sent_until_ > here - core_.setup.cycle && sent_until_ < until;
    const Time from = continues ? std::max(sent_until_, here) : here + core_.setup.lead;
    sent_any_ = true;
    sent_until_ = until;
    if (backup_sync) {
        const std::uint32_t cycle = core_.grid.number;
        send_sync(cycle, core_.start_of(cycle) + core_.setup.backup_offset);
    }
    if (core_.status.leading) {
        send_replies();
    }
    std::array<Turn, max_turns> turns;
    for (const Turn& turn : due_turns(turns, from, until)) {
        if (turn.index == slots_.size()) {
            send_sync(turn.cycle, turn.at);
        } else {
            send_slot(turn.index, turn.cycle);
        }
    }
}

}  // namespace hal::tdma
