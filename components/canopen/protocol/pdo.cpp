// SPDX-License-Identifier: MIT
#include "pdo.hpp"

#include <algorithm>
#include <utility>

namespace hal::canopen {

namespace {
constexpr std::uint16_t rpdo_base = 0x1400, tpdo_base = 0x1800, mapping_offset = 0x200, scanner_first = 0x1fa0, scanner_last = 0x1fcf;
constexpr bool event_driven(std::uint8_t transmission) noexcept { return transmission >= 254; }
constexpr bool on_request(std::uint8_t transmission) noexcept { return transmission == 252 || transmission == 253; }
constexpr bool synchronous(std::uint8_t transmission) noexcept { return transmission <= 240; }
std::uint64_t data_of(const Frame& f) noexcept { return load<std::uint64_t>(f.data.data()); }
}  // namespace

Pdos::Pdos(Dictionary& dictionary, FrameQueue& out, Emcy& emcy, Events& events, const PdoSettings& settings)
    : dictionary_(dictionary), out_(out), emcy_(emcy), events_(events), settings_(settings) {
    rpdo_of_.fill(-1);
    tpdo_of_.fill(-1);
    const auto room_of = [&](std::uint16_t mapping) {
        std::size_t room = 0;
        for (const auto& e : dictionary.object(mapping)) room = std::max<std::size_t>(room, e.sub);
        return room;
    };
    const auto handled = [&](unsigned communication) {
        const auto index = static_cast<std::uint16_t>(communication);
        const auto mapping = static_cast<std::uint16_t>(index + mapping_offset);
        if (dictionary.find(index, 1) == nullptr) return false;
        dictionary.handle(index, *this);
        dictionary.handle(mapping, *this);
        return true;
    };
    for (unsigned n = 1; n <= most; ++n) {
        if (handled(rpdo_base + n - 1)) {
            rpdo_of_[n] = static_cast<std::int16_t>(rpdos_.size());
            rpdos_.emplace_back(n, room_of(static_cast<std::uint16_t>(rpdo_base + mapping_offset + n - 1)));
        }
        if (handled(tpdo_base + n - 1)) {
            tpdo_of_[n] = static_cast<std::int16_t>(tpdos_.size());
            tpdos_.emplace_back(n, room_of(static_cast<std::uint16_t>(tpdo_base + mapping_offset + n - 1)));
        }
    }
    bool scans = false;
    for (unsigned list = scanner_first; list <= scanner_last; ++list)
        scans = dictionary.handle(static_cast<std::uint16_t>(list), *this) || scans;
    if (scans) scanned_.reserve(most_scanned);
    index_identifiers();
}

Pdos::Rpdo* Pdos::find_rpdo(unsigned number) noexcept {
    return number < 1 || number > most || rpdo_of_[number] < 0 ? nullptr : &rpdos_[static_cast<std::size_t>(rpdo_of_[number])];
}
Pdos::Tpdo* Pdos::find_tpdo(unsigned number) noexcept {
    return number < 1 || number > most || tpdo_of_[number] < 0 ? nullptr : &tpdos_[static_cast<std::size_t>(tpdo_of_[number])];
}

// Parameters.

void Pdos::read_communication(Rpdo& p) noexcept {
    const auto index = static_cast<std::uint16_t>(rpdo_base + p.number - 1);
    p.cob = dictionary_.get<std::uint32_t>(index, 1, cob_invalid);
    p.transmission = dictionary_.get<std::uint8_t>(index, 2, 255);
    p.event = dictionary_.get<std::uint16_t>(index, 5, 0) * millisecond;
}
void Pdos::read_communication(Tpdo& p) noexcept {
    const auto index = static_cast<std::uint16_t>(tpdo_base + p.number - 1);
    p.cob = dictionary_.get<std::uint32_t>(index, 1, cob_invalid);
    p.transmission = dictionary_.get<std::uint8_t>(index, 2, 255);
    p.inhibit = dictionary_.get<std::uint16_t>(index, 3, 0) * 100 * microsecond;
    p.event = dictionary_.get<std::uint16_t>(index, 5, 0) * millisecond;
    p.sync_start = dictionary_.get<std::uint8_t>(index, 6, 0);
}

Abort Pdos::read_mapping(Pdo& p, bool received) noexcept {
    const auto index = static_cast<std::uint16_t>((received ? rpdo_base : tpdo_base) + mapping_offset + p.number - 1);
    const auto count = dictionary_.get<std::uint8_t>(index, 0, 0);
    p.kind = count == 0xff ? Kind::destination_address : count == 0xfe ? Kind::source_address : Kind::plain;
    p.mapping.clear();
    if (p.kind != Kind::plain) return Abort::none;
    std::array<std::uint32_t, 64> entries{};
    if (count > entries.size()) return Abort::pdo_length;
    for (unsigned n = 0; n < count; ++n) entries[n] = dictionary_.get<std::uint32_t>(index, static_cast<std::uint8_t>(n + 1), 0);
    return p.mapping.build(dictionary_, {entries.data(), count}, received);
}

void Pdos::restart(Tpdo& p, Time now) noexcept {
    p.syncs = 0;
    p.waits_for_start = true;
    p.sampled = p.sent_once = p.again = false;
    p.pending = event_driven(p.transmission) && settings_.send_at_start;
    p.last = now;
}

void Pdos::index_identifiers() noexcept {
    rpdo_heads_.fill(-1);
    tpdo_heads_.fill(-1);
    const auto index = [](auto& pdos, auto& heads) {
        for (auto n = pdos.size(); n-- > 0;) {
            auto& p = pdos[n];
            if (!p.valid()) continue;
            auto& head = heads[(p.cob & cob_extended) != 0 ? extended_slot : cob_id(p.cob)];
            p.next = head;
            head = static_cast<std::int16_t>(n);
        }
    };
    index(rpdos_, rpdo_heads_);
    index(tpdos_, tpdo_heads_);
}

void Pdos::reset(std::uint8_t node_id) noexcept {
    node_id_ = node_id;
    operational_ = false;
    // A mapping that cannot be is left out: the PDO carries nothing until it is configured anew.
    for (auto& p : rpdos_) {
        read_communication(p);
        read_mapping(p, true);
        p.fresh = p.supervised = p.late = p.wrong_length = false;
    }
    for (auto& p : tpdos_) {
        read_communication(p);
        read_mapping(p, false);
    }
    read_scanner_list();
    index_identifiers();
}

void Pdos::set_operational(bool operational, Time now) noexcept {
    now_ = now;
    if (operational == operational_) return;
    operational_ = operational;
    synced_ = 0;
    for (auto& p : rpdos_) p.fresh = p.supervised = p.late = false;
    for (auto& p : tpdos_) restart(p, now);
    for (auto& s : scanned_) s.told = false;
}

Abort Pdos::check_communication(const Entry& e, std::span<const std::uint8_t> value, bool received, Pdo& p) noexcept {
    switch (e.sub) {
    case 1: {
        const auto cob = load<std::uint32_t>(value.data());
        if ((cob & cob_invalid) != 0) return Abort::none;
        if (p.valid() && ((cob ^ p.cob) & 0x3fffffff) != 0) return Abort::value;
        const auto id = cob_id(cob);
        return (cob & cob_extended) == 0 && (restricted(id) || id == 0x80 || (cob & 0x1ffff800) != 0) ? Abort::value : Abort::none;
    }
    case 2:
        if (value[0] > 240 && value[0] < (received ? 254 : 252)) return Abort::value;
        return Abort::none;
    case 3: return p.valid() && !received ? Abort::access : Abort::none;
    case 6: return p.valid() ? Abort::access : value[0] > 240 ? Abort::value : Abort::none;
    default: return Abort::none;
    }
}

Abort Pdos::check_mapping(const Entry& e, std::span<const std::uint8_t> value, bool received, Pdo& p) noexcept {
    if (p.valid()) return Abort::access;
    if (e.sub != 0) {
        if (dictionary_.get<std::uint8_t>(e.index, 0, 0) != 0) return Abort::access;
        const auto entry = load<std::uint32_t>(value.data());
        return entry == 0 ? Abort::none : Mapping::check(dictionary_, entry, received);
    }
    const auto count = value[0];
    if (count == 0xff || count == 0xfe) return Abort::none;
    if (count > 64 || (count != 0 && dictionary_.find(e.index, count) == nullptr)) return Abort::pdo_length;
    unsigned bits = 0;
    for (unsigned n = 1; n <= count; ++n) {
        const auto entry = dictionary_.get<std::uint32_t>(e.index, static_cast<std::uint8_t>(n), 0);
        if (const auto why = Mapping::check(dictionary_, entry, received); why != Abort::none) return why;
        bits += entry & 0xff;
    }
    return bits > 64 ? Abort::pdo_length : Abort::none;
}

Abort Pdos::writing(Entry& e, std::span<const std::uint8_t> value) noexcept {
    if (e.index >= scanner_first) return Abort::none;
    const bool received = e.index < tpdo_base;
    const unsigned number = ((e.index - (received ? rpdo_base : tpdo_base)) & 0x1ff) + 1U;
    Pdo* p = nullptr;
    if (received) p = find_rpdo(number);
    else p = find_tpdo(number);
    if (p == nullptr) return Abort::none;
    const bool mapping = (e.index & mapping_offset) != 0;
    return mapping ? check_mapping(e, value, received, *p) : check_communication(e, value, received, *p);
}

void Pdos::written(Entry& e) noexcept {
    if (e.index >= scanner_first) return read_scanner_list();
    const bool received = e.index < tpdo_base, mapping = (e.index & mapping_offset) != 0;
    const unsigned number = ((e.index - (received ? rpdo_base : tpdo_base)) & 0x1ff) + 1U;
    if (received) {
        if (auto* p = find_rpdo(number); p != nullptr) {
            if (mapping) read_mapping(*p, true);
            else read_communication(*p), p->supervised = p->late = p->fresh = false;
        }
    } else if (auto* p = find_tpdo(number); p != nullptr) {
        const bool was_valid = p->valid();
        if (mapping) read_mapping(*p, false);
        else read_communication(*p);
        if (e.sub == 2 || (p->valid() && !was_valid)) restart(*p, now_);
    }
    if (!mapping && e.sub == 1) index_identifiers();
}

// Receiving.

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
            if (!operational_ || p.held || (p.cob & cob_flag30) != 0 || p.kind != Kind::plain || synchronous(p.transmission)) continue;
            if (p.transmission == 252) {
                if (p.sampled) send(p, p.image, now);
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
        if (operational_ && !p.held && !(p.kind == Kind::plain ? receive(p, f, now) : receive_multiplexed(p, f, now))) ++p.errors;
    }
    return ours;
}

bool Pdos::receive(Rpdo& p, const Frame& f, Time now) noexcept {
    const auto bytes = p.mapping.bytes();
    if (f.length != bytes) {
        const Emcy::Bytes about{static_cast<std::uint8_t>(p.number), static_cast<std::uint8_t>(p.number >> 8), f.length, bytes};
        if (f.length < bytes) {
            if (!std::exchange(p.wrong_length, true)) events_.on_rpdo_short(p.number, f.length, now);
            emcy_.raise(0x8210, error_communication, about);
            return false;
        }
        if (settings_.report_too_long) p.wrong_length = true, emcy_.raise(0x8220, error_communication, about);
    } else if (p.wrong_length) {
        p.wrong_length = false;
        if (std::none_of(rpdos_.begin(), rpdos_.end(), [](const Rpdo& r) { return r.wrong_length; }))
            emcy_.clear(0x8210), emcy_.clear(0x8220);
    }
    came(p, now);
    if (!synchronous(p.transmission)) return take_over(p, data_of(f), now), true;
    if (window_ != 0 && synced_ != 0 && now - synced_ > window_) return false;  // came too late for its SYNC
    p.image = data_of(f);
    p.fresh = true;
    return true;
}

/// Its deadline begins anew.
void Pdos::came(Rpdo& p, Time now) noexcept {
    p.last = now;
    p.supervised = true;
    if (!std::exchange(p.late, false)) return;
    if (std::none_of(rpdos_.begin(), rpdos_.end(), [](const Rpdo& r) { return r.late; })) emcy_.clear(0x8250);
}

void Pdos::take_over(Rpdo& p, std::uint64_t image, Time now) noexcept {
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
        return e != nullptr && e->rpdo && e->size <= 4 && dictionary_.write(to, to_sub, {f.data.data() + 4, e->size}) == Abort::none;
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
        // 1FD0h–1FFFh: block size, own object, and node and object of the producer, from the highest byte down.
        bool found = false;
        for (unsigned list = 0x1fd0; list <= 0x1fff && !found; ++list) {
            for (const auto& e : dictionary_.object(static_cast<std::uint16_t>(list))) {
                if (e.sub == 0 || e.size != 8) continue;
                const auto row = load<std::uint64_t>(e.data);
                const auto block = static_cast<unsigned>(row >> 56), from = static_cast<unsigned>(row >> 8 & 0xff);
                if ((row & 0xff) != node || (row >> 16 & 0xffff) != index || sub < from || sub >= from + std::max(block, 1U)) continue;
                found = write(static_cast<std::uint16_t>(row >> 40), static_cast<std::uint8_t>((row >> 32 & 0xff) + sub - from));
                break;
            }
        }
        if (!found) return true;  // of no concern here
    }
    came(p, now);
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

// Sending.

bool Pdos::send(Tpdo& p, std::uint64_t image, Time now) noexcept {
    const auto bytes = p.mapping.bytes();
    if (bytes == 0) return true;
    Frame f = make_frame(p.cob, bytes);
    store(f.data.data(), image);
    if (!out_.push(f)) {
        ++p.errors;
        return false;
    }
    p.said = image;
    p.last = now;
    p.sent_once = true;
    p.pending = p.again = false;
    ++p.count;
    return true;
}

bool Pdos::trigger(unsigned number) noexcept {
    auto* p = find_tpdo(number);
    if (p == nullptr) return false;
    return p->pending = true;
}
void Pdos::trigger(const Entry& e) noexcept {
    for (auto& p : tpdos_)
        if ((event_driven(p.transmission) || p.transmission == 0) && p.valid() && p.mapping.maps(e)) p.pending = true;
}
bool Pdos::send_on_change(unsigned number, bool on) noexcept {
    auto* p = find_tpdo(number);
    if (p != nullptr) p->on_change = on;
    return p != nullptr;
}

void Pdos::hold_tpdo(unsigned number, bool on) noexcept {
    auto* p = find_tpdo(number);
    if (p == nullptr || p->held == on) return;
    p->held = on;
    restart(*p, now_);
}
void Pdos::hold_rpdo(unsigned number, bool on) noexcept {
    auto* p = find_rpdo(number);
    if (p == nullptr || p->held == on) return;
    p->held = on;
    p->fresh = p->supervised = p->late = p->wrong_length = false;
}

void Pdos::on_sync(Time now, Time window) noexcept {
    now_ = now, window_ = window, synced_ = now;
    if (!operational_) return;
    for (auto& p : rpdos_) {
        if (!p.fresh) continue;
        p.fresh = false;
        if (synchronous(p.transmission)) take_over(p, p.image, now);
    }
}

void Pdos::on_sync_send(std::uint8_t counter, bool counted, Time now) noexcept {
    if (!operational_) return;
    for (auto& p : tpdos_) {
        if (!p.valid() || p.held || p.kind != Kind::plain) continue;
        p.again = false;  // of the SYNC before: too late now
        if (p.transmission == 252) {
            p.image = p.mapping.pack(), p.sampled = true;
            continue;
        }
        if (!synchronous(p.transmission)) continue;
        if (p.transmission == 0) {
            if (p.on_change && p.mapping.pack() != p.said) p.pending = true;
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
        if (!send(p, p.image, now)) p.again = true;
    }
}

void Pdos::poll(Time now) noexcept {
    // A caller with a cycle calls when it was due, which an external clock reference moves by a little: a timer of one cycle is over when the
    // next call would be later than it, not only when all of its nanoseconds have passed.
    const Time interval = polled_ ? now - polled_at_ : 0;
    polled_ = true, polled_at_ = now;
    const auto is_over = [&](Time since, Time timer, Time part) { return now - since + std::min(interval / part, timer / 4) >= timer; };
    now_ = now;
    if (!operational_) return;
    for (auto& p : tpdos_) {
        if (p.held) continue;
        if (p.valid() && p.kind == Kind::source_address && event_driven(p.transmission)) scan(p, now);
        if (!p.valid() || p.kind != Kind::plain) continue;
        if (p.again && synchronous(p.transmission)) {
            if (window_ != 0 && now - synced_ > window_) p.again = false;
            else send(p, p.image, now);
            continue;
        }
        if (!event_driven(p.transmission)) continue;
        if (p.on_change && !p.pending && p.mapping.pack() != p.said) p.pending = true;
        const bool due = p.pending || (p.event != 0 && is_over(p.last, p.event, 2));
        if (due && (!p.sent_once || is_over(p.last, p.inhibit, 16))) send(p, p.mapping.pack(), now);
    }
    for (auto& p : rpdos_) {
        if (!p.supervised || p.late || p.event == 0 || !p.valid() || now - p.last < p.event) continue;
        p.late = true;
        p.supervised = false;
        emcy_.raise(0x8250, error_communication, {static_cast<std::uint8_t>(p.number), static_cast<std::uint8_t>(p.number >> 8)});
        events_.on_rpdo_late(p.number, now);
    }
}

bool Pdos::send_to(unsigned number, std::uint8_t destination, std::uint16_t index, std::uint8_t sub, std::uint32_t value) noexcept {
    auto* p = find_tpdo(number);
    if (p == nullptr || !p->valid() || !operational_ || p->kind != Kind::destination_address) return false;
    Frame f = make_frame(p->cob, 8);
    f.data[0] = static_cast<std::uint8_t>(0x80 | (destination & 0x7f));
    store(f.data.data() + 1, index);
    f.data[3] = sub;
    store(f.data.data() + 4, value);
    if (!out_.push(f)) return false;
    ++p->count, p->last = now_;
    return true;
}

bool Pdos::send_from(unsigned number, std::uint16_t index, std::uint8_t sub) noexcept {
    auto* p = find_tpdo(number);
    const Entry* e = dictionary_.find(index, sub);
    if (p == nullptr || e == nullptr || !p->valid() || !operational_ || p->kind != Kind::source_address || !e->tpdo || e->size > 4)
        return false;
    Frame f = make_frame(p->cob, 8);
    f.data[0] = node_id_;
    store(f.data.data() + 1, index);
    f.data[3] = sub;
    std::memcpy(f.data.data() + 4, e->data, e->size);
    if (!out_.push(f)) return false;
    ++p->count, p->last = now_;
    return true;
}

/// Rows of 1FA0h–1FCFh: block size, index and first sub-index of objects here, from the highest byte down.
void Pdos::read_scanner_list() noexcept {
    scanned_.clear();
    for (unsigned list = scanner_first; list <= scanner_last; ++list) {
        for (const auto& row : dictionary_.object(static_cast<std::uint16_t>(list))) {
            const auto value = row.sub != 0 && row.size == 4 ? load<std::uint32_t>(row.data) : 0;
            if (value == 0) continue;
            for (unsigned n = 0; n < std::max(value >> 24, 1U) && (value & 0xff) + n <= 0xff; ++n) {
                Entry* e = dictionary_.find(static_cast<std::uint16_t>(value >> 8), static_cast<std::uint8_t>((value & 0xff) + n));
                if (e != nullptr && e->tpdo && e->size <= 4 && scanned_.size() < scanned_.capacity()) scanned_.push_back({e});
            }
        }
    }
}

/// In turn, so that one that changes all the time keeps none of the others back.
void Pdos::scan(Tpdo& p, Time now) noexcept {
    for (std::size_t n = scanned_.size(); n > 0; --n, next_scanned_ = (next_scanned_ + 1) % scanned_.size()) {
        auto& s = scanned_[next_scanned_ % scanned_.size()];
        std::uint32_t value = 0;
        if (s.entry->handler != nullptr) s.entry->handler->reading(*s.entry);
        std::memcpy(&value, s.entry->data, s.entry->size);
        if (s.told && value == s.said) continue;
        if (p.sent_once && now - p.last < p.inhibit) return;
        if (!send_from(p.number, s.entry->index, s.entry->sub)) return;
        s.said = value, s.told = p.sent_once = true;
        p.last = now;
    }
}

Pdos::Status Pdos::rpdo(unsigned number) const noexcept {
    const auto* p = const_cast<Pdos*>(this)->find_rpdo(number);
    if (p == nullptr) return {};
    return {true, p->valid(), p->late, p->cob, p->transmission, p->mapping.bytes(), p->count, p->errors, p->last};
}
Pdos::Status Pdos::tpdo(unsigned number) const noexcept {
    const auto* p = const_cast<Pdos*>(this)->find_tpdo(number);
    if (p == nullptr) return {};
    return {true, p->valid(), false, p->cob, p->transmission, p->mapping.bytes(), p->count, p->errors, p->last};
}

}  // namespace hal::canopen
