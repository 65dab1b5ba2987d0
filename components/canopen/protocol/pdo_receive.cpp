// SPDX-License-Identifier: MIT
#include <algorithm>
#include <utility>

#include "pdo.hpp"

namespace hal::canopen {

bool Pdos::handle(const Frame& f, Time now) noexcept {
    now_ = now;
    if (!f.extended && f.id >= extended_slot) return false;
    const auto slot = f.extended ? extended_slot : f.id;
    bool ours = false;
    if (f.remote) {
        for (auto n = tpdo_heads_[slot]; n >= 0; n = tpdos_[static_cast<std::size_t>(n)].next) {
            auto& p = tpdos_[static_cast<std::size_t>(n)];
            if (cob_id(p.cob) != f.id) continue;
            ours = true;
            if (!operational_ || p.held || (p.cob & cob_flag30) != 0 || p.kind != Kind::plain ||
                p.synchronous()) {
                continue;
            }
            if (p.transmission == 252) {
                if (p.sampled) {
                    send(p, p.image, now);
                }
            } else {
                send(p, p.mapping.pack(), now);
            }
        }
        return ours;
    }
    for (auto n = rpdo_heads_[slot]; n >= 0; n = rpdos_[static_cast<std::size_t>(n)].next) {
        auto& p = rpdos_[static_cast<std::size_t>(n)];
        if (cob_id(p.cob) != f.id) continue;
        ours = true;
        if (operational_ && !p.held &&
            !(p.kind == Kind::plain ? receive(p, f, now) : receive_multiplexed(p, f, now))) {
            ++p.errors;
        }
    }
    return ours;
}

bool Pdos::receive(Rpdo& p, const Frame& f, Time now) noexcept {
    const auto bytes = p.mapping.bytes();
    if (f.length != bytes) {
        const Emcy::Bytes details{static_cast<std::uint8_t>(p.number),
                                  static_cast<std::uint8_t>(p.number >> 8), f.length, bytes};
        if (f.length < bytes) {
            if (!std::exchange(p.wrong_length, true)) {
                events_.on_rpdo_short(p.number, f.length, now);
            }
            emcy_.raise(0x8210, error_communication, details);
            return false;
        }
        if (settings_.report_too_long) {
            p.wrong_length = true;
            emcy_.raise(0x8220, error_communication, details);
        }
    } else if (p.wrong_length) {
        p.wrong_length = false;
        if (std::none_of(rpdos_.begin(), rpdos_.end(),
                         [](const Rpdo& r) { return r.wrong_length; })) {
            emcy_.clear(0x8210);
            emcy_.clear(0x8220);
        }
    }
    restart_deadline(p, now);
    if (!p.synchronous()) {
        apply(p, load<std::uint64_t>(f.data.data()), now);
        return true;
    }
    // arrived after the synchronous window
    if (window_ != 0 && synced_ != 0 && now - synced_ > window_) return false;
    p.image = load<std::uint64_t>(f.data.data());
    p.fresh = true;
    return true;
}

/// Restarts the deadline of the RPDO.
void Pdos::restart_deadline(Rpdo& p, Time now) noexcept {
    p.last = now;
    p.supervised = true;
    if (!std::exchange(p.late, false)) return;
    if (std::none_of(rpdos_.begin(), rpdos_.end(), [](const Rpdo& r) { return r.late; })) {
        emcy_.clear(0x8250);
    }
}

void Pdos::apply(Rpdo& p, std::uint64_t image, Time now) noexcept {
    p.mapping.unpack(image);
    ++p.count;
    events_.on_rpdo(p.number, now);
}

bool Pdos::receive_multiplexed(Rpdo& p, const Frame& f, Time now) noexcept {
    if (f.length != 8) return false;
    const bool addressed = (f.data[0] & 0x80) != 0;
    const auto node = static_cast<std::uint8_t>(f.data[0] & 0x7f);
    const auto index = load<std::uint16_t>(f.data.data() + 1);
    const auto sub = f.data[3];
    const auto write = [&](std::uint16_t to, std::uint8_t to_sub) {
        const Entry* e = dictionary_.find(to, to_sub);
        return e != nullptr && e->rpdo && e->size <= 4 &&
               dictionary_.write(to, to_sub, {f.data.data() + 4, e->size}) == Abort::none;
    };
    if (addressed) {
        if (p.kind != Kind::destination_address) return false;
        if (node != 0 && node != node_id_) return true;
        if (!write(index, sub)) {
            emcy_.raise(0x8230, error_communication, {f.data[1], f.data[2], f.data[3]});
            return false;
        }
        emcy_.clear(0x8230);
    } else {
        if (p.kind != Kind::source_address) return false;
        // 1FD0h–1FFFh, from the most significant byte: block size, object of this node, node ID and
        // object of the producer (CiA 301).
        bool found = false;
        for (unsigned list = 0x1fd0; list <= 0x1fff && !found; ++list) {
            for (const auto& e : dictionary_.object(static_cast<std::uint16_t>(list))) {
                if (e.sub == 0 || e.size != 8) continue;
                const auto row = load<std::uint64_t>(e.data);
                const auto block = static_cast<unsigned>(row >> 56);

                const auto from = static_cast<unsigned>(row >> 8 & 0xff);
                if ((row & 0xff) != node || (row >> 16 & 0xffff) != index || sub < from ||
                    sub >= from + std::max(block, 1U)) {
                    continue;
                }
                found = write(static_cast<std::uint16_t>(row >> 40),
                              static_cast<std::uint8_t>((row >> 32 & 0xff) + sub - from));
                break;
            }
        }
        if (!found) {
            return true;  // not in the dispatching list
        }
    }
    restart_deadline(p, now);
    ++p.count;
    events_.on_rpdo(p.number, now);
    return true;
}

bool Pdos::request(unsigned number) noexcept {
    const auto* p = find_rpdo(number);
    if (p == nullptr || !p->valid() || (p->cob & cob_flag30) != 0 || !operational_) return false;
    Frame f = make_frame(p->cob, p->mapping.bytes());
    f.remote = true;
    return out_.push(f);
}

void Pdos::hold_rpdo(unsigned number, bool on) noexcept {
    auto* p = find_rpdo(number);
    if (p == nullptr || p->held == on) return;
    p->held = on;
    p->fresh = p->supervised = p->late = p->wrong_length = false;
}

void Pdos::on_sync(Time now, Time window) noexcept {
    now_ = now;
    window_ = window;
    synced_ = now;
    if (!operational_) return;
    for (auto& p : rpdos_) {
        if (!p.fresh) continue;
        p.fresh = false;
        if (p.synchronous()) {
            apply(p, p.image, now);
        }
    }
}

}  // namespace hal::canopen
