// SPDX-License-Identifier: MIT
#include <algorithm>

#include "pdo.hpp"

namespace hal::canopen {

bool Pdos::send(Tpdo& p, std::uint64_t image, Time now) noexcept {
    const auto bytes = p.mapping.bytes();
    if (bytes == 0) return true;
    Frame f = make_frame(p.cob, bytes);
    store(f.data.data(), image);
    if (!out_.push(f)) {
        ++p.errors;
        return false;
    }
    p.last_sent = image;
    p.last = now;
    p.sent_once = true;
    p.pending = p.retry = false;
    ++p.count;
    return true;
}

bool Pdos::trigger(unsigned number) noexcept {
    auto* p = find_tpdo(number);
    if (p == nullptr) return false;
    return p->pending = true;
}
void Pdos::trigger(const Entry& e) noexcept {
    for (auto& p : tpdos_) {
        if ((p.event_driven() || p.transmission == 0) && p.valid() && p.mapping.maps(e)) {
            p.pending = true;
        }
    }
}
bool Pdos::send_on_change(unsigned number, bool on) noexcept {
    auto* p = find_tpdo(number);
    if (p != nullptr) {
        p->on_change = on;
    }
    return p != nullptr;
}

void Pdos::hold_tpdo(unsigned number, bool on) noexcept {
    auto* p = find_tpdo(number);
    if (p == nullptr || p->held == on) return;
    p->held = on;
    restart(*p, now_);
}
void Pdos::send_synchronous(std::uint8_t counter, bool counted, Time now) noexcept {
    if (!operational_) return;
    for (auto& p : tpdos_) {
        if (!p.valid() || p.held || p.kind != Kind::plain) continue;
        p.retry = false;  // too late for the previous SYNC
        if (p.transmission == 252) {
            p.image = p.mapping.pack();
            p.sampled = true;
            continue;
        }
        if (!p.synchronous()) continue;
        if (p.transmission == 0) {
            if (p.on_change && p.mapping.pack() != p.last_sent) {
                p.pending = true;
            }
            if (!p.pending) continue;
        } else {
            if (p.waits_for_start && counted && p.sync_start != 0) {
                if (counter != p.sync_start) continue;
                p.waits_for_start = false;
                p.syncs = static_cast<std::uint8_t>(p.transmission - 1);
            }
            p.waits_for_start = false;
            if (++p.syncs < p.transmission) continue;
            p.syncs = 0;
        }
        p.image = p.mapping.pack();
        if (!send(p, p.image, now)) {
            p.retry = true;
        }
    }
}

void Pdos::poll(Time now) noexcept {
    // Polls are a little early or late, because an external clock reference adjusts the caller's
    // cycle: a timer has expired if the next poll would be later than its end, not only after its
    // last nanosecond.
    const Time interval = polled_ ? now - polled_at_ : 0;
    polled_ = true;
    polled_at_ = now;
    const auto expired = [&](Time since, Time timer, Time part) {
        return now - since + std::min(interval / part, timer / 4) >= timer;
    };
    now_ = now;
    if (!operational_) return;
    for (auto& p : tpdos_) {
        if (p.held) continue;
        if (p.valid() && p.kind == Kind::source_address && p.event_driven()) {
            scan(p, now);
        }
        if (!p.valid() || p.kind != Kind::plain) continue;
        if (p.retry && p.synchronous()) {
            if (window_ != 0 && now - synced_ > window_) {
                p.retry = false;
            } else {
                send(p, p.image, now);
            }
            continue;
        }
        if (!p.event_driven()) continue;
        if (p.on_change && !p.pending && p.mapping.pack() != p.last_sent) {
            p.pending = true;
        }
        const bool due = p.pending || (p.event != 0 && expired(p.last, p.event, 2));
        if (due && (!p.sent_once || expired(p.last, p.inhibit, 16))) {
            send(p, p.mapping.pack(), now);
        }
    }
    for (auto& p : rpdos_) {
        if (!p.supervised || p.late || p.event == 0 || !p.valid() || now - p.last < p.event) {
            continue;
        }
        p.late = true;
        p.supervised = false;
        emcy_.raise(
            0x8250, error_communication,
            {static_cast<std::uint8_t>(p.number), static_cast<std::uint8_t>(p.number >> 8)});
        events_.on_rpdo_late(p.number, now);
    }
}

bool Pdos::send_dam(unsigned number, std::uint8_t destination, std::uint16_t index,
                    std::uint8_t sub, std::uint32_t value) noexcept {
    auto* p = find_tpdo(number);
    if (p == nullptr || !p->valid() || !operational_ || p->kind != Kind::destination_address) {
        return false;
    }
    Frame f = make_frame(p->cob, 8);
    f.data[0] = static_cast<std::uint8_t>(0x80 | (destination & 0x7f));
    store(f.data.data() + 1, index);
    f.data[3] = sub;
    store(f.data.data() + 4, value);
    if (!out_.push(f)) return false;
    ++p->count;
    p->last = now_;
    return true;
}

bool Pdos::send_sam(unsigned number, std::uint16_t index, std::uint8_t sub) noexcept {
    auto* p = find_tpdo(number);
    const Entry* e = dictionary_.find(index, sub);
    if (p == nullptr || e == nullptr || !p->valid() || !operational_ ||
        p->kind != Kind::source_address || !e->tpdo || e->size > 4) {
        return false;
    }
    Frame f = make_frame(p->cob, 8);
    f.data[0] = node_id_;
    store(f.data.data() + 1, index);
    f.data[3] = sub;
    std::memcpy(f.data.data() + 4, e->data, e->size);
    if (!out_.push(f)) return false;
    ++p->count;
    p->last = now_;
    return true;
}

/// Round robin, so that an object that changes in every cycle does not block the others.
void Pdos::scan(Tpdo& p, Time now) noexcept {
    for (std::size_t n = scanned_.size(); n > 0;
         --n, next_scanned_ = (next_scanned_ + 1) % scanned_.size()) {
        auto& s = scanned_[next_scanned_ % scanned_.size()];
        std::uint32_t value = 0;
        if (s.entry->handler != nullptr) {
            s.entry->handler->reading(*s.entry);
        }
        std::memcpy(&value, s.entry->data, s.entry->size);
        if (s.sent && value == s.last_sent) continue;
        if (p.sent_once && now - p.last < p.inhibit) return;
        if (!send_sam(p.number, s.entry->index, s.entry->sub)) return;
        s.last_sent = value;
        s.sent = p.sent_once = true;
        p.last = now;
    }
}

}  // namespace hal::canopen
