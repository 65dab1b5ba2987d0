// SPDX-License-Identifier: MIT
// Sends every frame that is due within the next cycle, in order of time.
#include <algorithm>

#include "station.hpp"

namespace hal::tdma {

bool Station::launch(std::span<const std::uint8_t> frame, const ethernet::Launch& how) noexcept {
    const auto sent = port_->send(frame, how, status_.global - status_.offset);
    if (sent == ethernet::Sent::late) {
        ++status_.count.late;
    } else if (sent != ethernet::Sent::queued) {
        ++status_.count.dropped;
    }
    return sent == ethernet::Sent::queued;
}

void Station::send_sync(std::uint32_t cycle, Time global_at) noexcept {
    const Time at = clock_.local(global_at);
    const Frame frame = encode(address_, Sync{cycle, global_at, start_of(cycle)});
    // The port stamps the frame when it leaves; stamp_add_ns converts to global time.
    if (launch(frame, {.at_ns = at,
                       .guard_ns = setup_.cycle / 2,
                       .stamp_at = sync_stamp_at,
                       .stamp_add_ns = global_at - at})) {
        ++status_.count.syncs_sent;
    }
}

bool Station::send_request(const Slot& slot, std::uint32_t cycle, Time local_at) noexcept {
    // RTnet's stations give the master one period of the slot for its answer. That is too short for
    // an early slot when the master's thread runs later, so the reply is at least two cycles later.
    const std::uint32_t period = slot.setup().period;
    const std::uint32_t reply_cycle = cycle + period * std::max(1U, (2 + period - 1) / period);
    const Frame frame =
        encode(status_.master, address_, Request{local_at, reply_cycle, slot.setup().offset});
    calibration_.sent(reply_cycle, local_at,
                      clock_.local(start_of(reply_cycle) + slot.setup().offset));
    ++status_.count.requests;
    return launch(frame, {.at_ns = local_at,
                          .guard_ns = setup_.guard,
                          .stamp_at = request_stamp_at,
                          .stamp_add_ns = 0});
}

void Station::send_slot(std::size_t index, std::uint32_t cycle) noexcept {
    Slot& slot = slots_[index];
    const Time global_at = start_of(cycle) + slot.setup().offset;
    const Time at = clock_.local(global_at);
    if (index == 0 && calibration_.active() && !status_.leading) {
        if (calibration_.reserved(cycle)) {
            return;  // reserved for the master's reply
        }
        const bool turn = status_.state == State::calibrating || recalibration_ == 0 ||
                          cycle / slot.setup().period % recalibration_ == 0;
        if (turn && calibration_.due(cycle, slot.setup().period)) {
            send_request(slot, cycle, at);
            return;
        }
    }
    if (status_.state != State::running) return;
    std::size_t used = 0;
    for (auto frame = slot.front(); !frame.empty(); frame = slot.front()) {
        const std::size_t takes = ethernet::wire_bytes(frame.size());
        if (takes > slot.turn_bytes()) {  // queued while the slot was changed
            ++status_.count.dropped;
            slot.pop();
            continue;
        }
        if (used + takes > slot.turn_bytes()) break;
        if (launch(frame, {.at_ns = at + wire_time(used),
                           .guard_ns = setup_.guard,
                           .finisher = slot.finisher()})) {
            ++status_.count.sent;
        }
        slot.pop();
        used += takes;
    }
    send_pings(slot, at, used);
}

/// Uses the time that real-time frames leave in a turn.
void Station::send_pings(const Slot& slot, Time slot_at, std::size_t used) noexcept {
    constexpr std::size_t takes = ethernet::wire_bytes(ethernet::smallest_frame);
    while (used + takes <= slot.turn_bytes()) {
        const Time at = slot_at + wire_time(used);
        if (const Pings::Owed* owed = pings_.answer(); owed != nullptr) {
            const Frame frame = encode(owed->to, address_,
                                       Echo{owed->ping_stamp, owed->received, at, owed->number});
            if (launch(frame, {.at_ns = at,
                               .guard_ns = setup_.guard,
                               .stamp_at = echo_stamp_at,
                               .stamp_add_ns = 0})) {
                ++status_.count.sent;
            }
            pings_.pop_answer();
            used += takes;
            continue;
        }
        const std::size_t n = pings_.waiting();
        if (n == pings_.size()) return;
        const Address to = n >= setup_.others.size()      ? status_.master
                           : roster_[n].from != Address{} ? roster_[n].from
                                                          : setup_.others[n].mac;
        if (to == Address{}) {
            pings_.fail(n, Outcome::no_address);
            continue;
        }
        const Frame frame = encode(to, address_, Ping{at, pings_[n].number});
        // try again
        if (!launch(frame, {.at_ns = at,
                            .guard_ns = setup_.guard,
                            .stamp_at = ping_stamp_at,
                            .stamp_add_ns = 0})) {
            return;
        }
        ++status_.count.sent;
        pings_.sent(n, to, at);
        used += takes;
    }
}

void Station::send_replies() noexcept {
    for (Pending& p : pending_) {
        if (!p.used) continue;
        const Time global_at = start_of(p.cycle) + p.offset;
        const Time at = clock_.local(global_at);
        if (at > status_.global - status_.offset + reach()) {
            continue;  // not in this turn
        }
        p.used = false;
        if (at <= status_.global - status_.offset) {
            ++status_.count.too_late;
            continue;
        }
        const Frame frame = encode(p.to, address_, Reply{p.stamp, p.received, global_at});
        if (launch(frame, {.at_ns = at,
                           .guard_ns = setup_.guard,
                           .stamp_at = reply_stamp_at,
                           .stamp_add_ns = global_at - at})) {
            ++status_.count.served;
        }
    }
}

void Station::transmit(Time now) noexcept {
    status_.count.dropped += rejected_.exchange(0, std::memory_order_relaxed);
    if (port_ == nullptr || !based_ || !clock_.settled()) return;
    const State state = status_.state;
    if (state != State::calibrating && state != State::running) return;
    if (state == State::running) {
        if (rtcfg_ != nullptr) {
            rtcfg_->before_slots(now);
        }
        if (tunnel_ != nullptr) {
            tunnel_->before_slots(now);
        }
    }
    const Time here = clock_.global(now);
    const Time until = here + reach();
    // A slot has its turn once, whatever the thread's clock was stepped by; what lies behind the
    // thread is lost.
    const Time from = sent_any_ && sent_until_ > here - setup_.cycle && sent_until_ < until
                          ? std::max(sent_until_, here)
                          : here + setup_.lead;
    sent_any_ = true;
    sent_until_ = until;

    // A backup decides in the cycle itself, when the sync has not come.
    if (setup_.role == Role::backup && status_.leading && may_lead()) {
        const std::uint32_t cycle = number_;
        send_sync(cycle, start_of(cycle) + setup_.backup_offset);
    }
    if (status_.leading) {
        send_replies();
    }

    struct Turn {
        Time at;
        std::size_t index;  // slots_.size(): the sync
        std::uint32_t cycle;
    };
    std::array<Turn, 4 * (most_slots + 1)> turns;
    std::size_t count = 0;
    for (std::uint32_t c = number_ - 1; static_cast<std::int32_t>(c - number_) <= 2; ++c) {
        const Time start = start_of(c);
        const auto add = [&](Time at, std::size_t index) {
            if (at > from && at <= until) {
                turns[count++] = {at, index, c};
            }
        };
        if (status_.leading && setup_.role == Role::master) {
            add(start, slots_.size());
        }
        for (std::size_t i = 0; i < slots_.size(); ++i) {
            if (slots_[i].used_in(c)) {
                add(start + slots_[i].setup().offset, i);
            }
        }
    }
    std::sort(turns.begin(), turns.begin() + static_cast<std::ptrdiff_t>(count),
              [this](const Turn& a, const Turn& b) {
        return a.at != b.at ? a.at<b.at : (a.index == slots_.size())>(b.index == slots_.size());
    });
    for (std::size_t i = 0; i < count; ++i) {
        const Turn& t = turns[i];
        if (t.index == slots_.size()) {
            send_sync(t.cycle, t.at);
        } else {
            send_slot(t.index, t.cycle);
        }
    }
}

}  // namespace hal::tdma
