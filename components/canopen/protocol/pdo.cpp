// SPDX-License-Identifier: MIT
#include "pdo.hpp"

#include <algorithm>
#include <utility>

namespace hal::canopen {

namespace {
constexpr std::uint16_t rpdo_base = 0x1400;
constexpr std::uint16_t tpdo_base = 0x1800;
constexpr std::uint16_t mapping_offset = 0x200;

constexpr std::uint16_t scanner_first = 0x1fa0;
constexpr std::uint16_t scanner_last = 0x1fcf;
}  // namespace

Pdos::Pdos(Dictionary& dictionary, FrameQueue& out, Emcy& emcy, Events& events,
           const PdoSettings& settings)
    : dictionary_(dictionary), out_(out), emcy_(emcy), events_(events), settings_(settings) {
    rpdo_of_.fill(-1);
    tpdo_of_.fill(-1);
    const auto capacity_of = [&](std::uint16_t mapping) {
        std::size_t capacity = 0;
        for (const auto& e : dictionary.object(mapping)) {
            capacity = std::max<std::size_t>(capacity, e.sub);
        }
        return capacity;
    };
    const auto handled = [&](unsigned communication) {
        const auto index = static_cast<std::uint16_t>(communication);
        const auto mapping = static_cast<std::uint16_t>(index + mapping_offset);
        if (dictionary.find(index, 1) == nullptr) return false;
        dictionary.handle(index, *this);
        dictionary.handle(mapping, *this);
        return true;
    };
    for (unsigned n = 1; n <= max_pdos; ++n) {
        if (handled(rpdo_base + n - 1)) {
            rpdo_of_[n] = static_cast<std::int16_t>(rpdos_.size());
            rpdos_.emplace_back(
                n, capacity_of(static_cast<std::uint16_t>(rpdo_base + mapping_offset + n - 1)));
        }
        if (handled(tpdo_base + n - 1)) {
            tpdo_of_[n] = static_cast<std::int16_t>(tpdos_.size());
            tpdos_.emplace_back(
                n, capacity_of(static_cast<std::uint16_t>(tpdo_base + mapping_offset + n - 1)));
        }
    }
    bool scans = false;
    for (unsigned list = scanner_first; list <= scanner_last; ++list) {
        scans = dictionary.handle(static_cast<std::uint16_t>(list), *this) || scans;
    }
    if (scans) {
        scanned_.reserve(max_scanned);
    }
    index_identifiers();
}

Pdos::Rpdo* Pdos::find_rpdo(unsigned number) noexcept {
    return number < 1 || number > max_pdos || rpdo_of_[number] < 0
               ? nullptr
               : &rpdos_[static_cast<std::size_t>(rpdo_of_[number])];
}
Pdos::Tpdo* Pdos::find_tpdo(unsigned number) noexcept {
    return number < 1 || number > max_pdos || tpdo_of_[number] < 0
               ? nullptr
               : &tpdos_[static_cast<std::size_t>(tpdo_of_[number])];
}

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
    const auto index = static_cast<std::uint16_t>((received ? rpdo_base : tpdo_base) +
                                                  mapping_offset + p.number - 1);
    const auto count = dictionary_.get<std::uint8_t>(index, 0, 0);
    if (count == 0xff) {
        p.kind = Kind::destination_address;
    } else if (count == 0xfe) {
        p.kind = Kind::source_address;
    } else {
        p.kind = Kind::plain;
    }
    p.mapping.clear();
    if (p.kind != Kind::plain) return Abort::none;
    std::array<std::uint32_t, 64> entries{};
    if (count > entries.size()) return Abort::pdo_length;
    for (unsigned n = 0; n < count; ++n) {
        entries[n] = dictionary_.get<std::uint32_t>(index, static_cast<std::uint8_t>(n + 1), 0);
    }
    return p.mapping.build(dictionary_, {entries.data(), count}, received);
}

void Pdos::restart(Tpdo& p, Time now) noexcept {
    p.syncs = 0;
    p.waits_for_start = true;
    p.sampled = p.sent_once = p.retry = false;
    p.pending = p.event_driven() && settings_.send_at_start;
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
    // A PDO with an invalid mapping carries nothing until it is configured again.
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
    for (auto& p : rpdos_) {
        p.fresh = p.supervised = p.late = false;
    }
    for (auto& p : tpdos_) {
        restart(p, now);
    }
    for (auto& s : scanned_) {
        s.sent = false;
    }
}

Abort Pdos::check_communication(const Entry& e, std::span<const std::uint8_t> value, bool received,
                                Pdo& p) noexcept {
    switch (e.sub) {
    case 1: {
        const auto cob = load<std::uint32_t>(value.data());
        if ((cob & cob_invalid) != 0) return Abort::none;
        if (p.valid() && ((cob ^ p.cob) & 0x3fffffff) != 0) return Abort::value;
        if ((cob & cob_extended) != 0) return Abort::none;
        const auto id = cob_id(cob);
        const bool reserved = restricted(id) || id == 0x80 || (cob & 0x1ffff800) != 0;
        return reserved ? Abort::value : Abort::none;
    }
    case 2:
        if (value[0] > 240 && value[0] < (received ? 254 : 252)) return Abort::value;
        return Abort::none;
    case 3: return p.valid() && !received ? Abort::access : Abort::none;
    case 6:
        if (p.valid()) return Abort::access;
        if (value[0] > 240) return Abort::value;
        return Abort::none;
    default: return Abort::none;
    }
}

Abort Pdos::check_mapping(const Entry& e, std::span<const std::uint8_t> value, bool received,
                          Pdo& p) noexcept {
    if (p.valid()) return Abort::access;
    if (e.sub != 0) {
        if (dictionary_.get<std::uint8_t>(e.index, 0, 0) != 0) return Abort::access;
        const auto entry = load<std::uint32_t>(value.data());
        return entry == 0 ? Abort::none : Mapping::check(dictionary_, entry, received);
    }
    const auto count = value[0];
    if (count == 0xff || count == 0xfe) return Abort::none;
    if (count > 64 || (count != 0 && dictionary_.find(e.index, count) == nullptr)) {
        return Abort::pdo_length;
    }
    unsigned bits = 0;
    for (unsigned n = 1; n <= count; ++n) {
        const auto entry = dictionary_.get<std::uint32_t>(e.index, static_cast<std::uint8_t>(n), 0);
        if (const auto why = Mapping::check(dictionary_, entry, received); why != Abort::none) {
            return why;
        }
        bits += entry & 0xff;
    }
    return bits > 64 ? Abort::pdo_length : Abort::none;
}

Abort Pdos::writing(Entry& e, std::span<const std::uint8_t> value) noexcept {
    if (e.index >= scanner_first) return Abort::none;
    const bool received = e.index < tpdo_base;
    const unsigned number = ((e.index - (received ? rpdo_base : tpdo_base)) & 0x1ff) + 1U;
    Pdo* p = nullptr;
    if (received) {
        p = find_rpdo(number);
    } else {
        p = find_tpdo(number);
    }
    if (p == nullptr) return Abort::none;
    const bool mapping = (e.index & mapping_offset) != 0;
    return mapping ? check_mapping(e, value, received, *p)
                   : check_communication(e, value, received, *p);
}

void Pdos::written(Entry& e) noexcept {
    if (e.index >= scanner_first) return read_scanner_list();
    const bool received = e.index < tpdo_base;
    const bool mapping = (e.index & mapping_offset) != 0;
    const unsigned number = ((e.index - (received ? rpdo_base : tpdo_base)) & 0x1ff) + 1U;
    if (Rpdo* p = received ? find_rpdo(number) : nullptr; p != nullptr) {
        apply_parameter(*p, mapping);
    }
    if (Tpdo* p = received ? nullptr : find_tpdo(number); p != nullptr) {
        apply_parameter(*p, mapping, e.sub);
    }
    if (!mapping && e.sub == 1) {
        index_identifiers();
    }
}

void Pdos::apply_parameter(Rpdo& p, bool mapping) noexcept {
    if (mapping) {
        read_mapping(p, true);
        return;
    }
    read_communication(p);
    p.supervised = p.late = p.fresh = false;
}

void Pdos::apply_parameter(Tpdo& p, bool mapping, std::uint8_t sub) noexcept {
    const bool was_valid = p.valid();
    if (mapping) {
        read_mapping(p, false);
    } else {
        read_communication(p);
    }
    if (sub == 2 || (p.valid() && !was_valid)) {
        restart(p, now_);
    }
}

/// Entries of 1FA0h–1FCFh, from the most significant byte: block size, index and first sub-index of
/// objects of this node (CiA 301).
void Pdos::read_scanner_list() noexcept {
    scanned_.clear();
    for (unsigned list = scanner_first; list <= scanner_last; ++list) {
        for (const auto& row : dictionary_.object(static_cast<std::uint16_t>(list))) {
            const auto value = row.sub != 0 && row.size == 4 ? load<std::uint32_t>(row.data) : 0;
            if (value == 0) continue;
            for (unsigned n = 0; n < std::max(value >> 24, 1U) && (value & 0xff) + n <= 0xff; ++n) {
                Entry* e = dictionary_.find(static_cast<std::uint16_t>(value >> 8),
                                            static_cast<std::uint8_t>((value & 0xff) + n));
                if (e != nullptr && e->tpdo && e->size <= 4 &&
                    scanned_.size() < scanned_.capacity()) {
                    scanned_.push_back({e});
                }
            }
        }
    }
}

// Reception.

bool Pdos::handle(const Frame& f, Time now) noexcept {
    now_ = now;
    if (!f.extended && f.id >= extended_slot) return false;
    const auto slot = f.extended ? extended_slot : f.id;
    return f.remote ? handle_request(f, slot, now) : handle_data(f, slot, now);
}

bool Pdos::handle_request(const Frame& f, std::size_t slot, Time now) noexcept {
    bool ours = false;
    for (auto n = tpdo_heads_[slot]; n >= 0; n = tpdos_[static_cast<std::size_t>(n)].next) {
        auto& p = tpdos_[static_cast<std::size_t>(n)];
        if (cob_id(p.cob) != f.id) continue;
        ours = true;
        const bool answers = operational_ && !p.held && (p.cob & cob_flag30) == 0 &&
                             p.kind == Kind::plain && !p.synchronous();
        if (!answers) continue;
        if (p.transmission != 252) {
            send(p, p.mapping.pack(), now);
        } else if (p.sampled) {
            send(p, p.image, now);
        }
    }
    return ours;
}

bool Pdos::handle_data(const Frame& f, std::size_t slot, Time now) noexcept {
    bool ours = false;
    for (auto n = rpdo_heads_[slot]; n >= 0; n = rpdos_[static_cast<std::size_t>(n)].next) {
        auto& p = rpdos_[static_cast<std::size_t>(n)];
        if (cob_id(p.cob) != f.id) continue;
        ours = true;
        if (!operational_ || p.held) continue;
        const bool good =
            p.kind == Kind::plain ? receive(p, f, now) : receive_multiplexed(p, f, now);
        if (!good) {
            ++p.errors;
        }
    }
    return ours;
}

/// Returns false if the PDO is too short. A wrong length is reported by an emergency.
bool Pdos::check_length(Rpdo& p, const Frame& f, Time now) noexcept {
    const auto bytes = p.mapping.bytes();
    if (f.length == bytes && !p.wrong_length) return true;
    const Emcy::Bytes details{static_cast<std::uint8_t>(p.number),
                              static_cast<std::uint8_t>(p.number >> 8), f.length, bytes};
    if (f.length < bytes) {
        if (!std::exchange(p.wrong_length, true)) {
            events_.on_rpdo_short(p.number, f.length, now);
        }
        emcy_.raise(0x8210, error_communication, details);
        return false;
    }
    if (f.length > bytes && settings_.report_too_long) {
        p.wrong_length = true;
        emcy_.raise(0x8220, error_communication, details);
    }
    if (f.length > bytes) return true;
    p.wrong_length = false;
    const bool none_wrong =
        std::none_of(rpdos_.begin(), rpdos_.end(), [](const Rpdo& r) { return r.wrong_length; });
    if (none_wrong) {
        emcy_.clear(0x8210);
        emcy_.clear(0x8220);
    }
    return true;
}

bool Pdos::receive(Rpdo& p, const Frame& f, Time now) noexcept {
    if (!check_length(p, f, now)) return false;
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
    const Kind kind = addressed ? Kind::destination_address : Kind::source_address;
    if (p.kind != kind) return false;
    const auto node = static_cast<std::uint8_t>(f.data[0] & 0x7f);
    if (addressed) {
        if (node != 0 && node != node_id_) return true;
        if (!write_multiplexed(f, load<std::uint16_t>(f.data.data() + 1), f.data[3])) {
            emcy_.raise(0x8230, error_communication, {f.data[1], f.data[2], f.data[3]});
            return false;
        }
        emcy_.clear(0x8230);
    } else if (!dispatch(node, f)) {
        return true;
    }
    restart_deadline(p, now);
    ++p.count;
    events_.on_rpdo(p.number, now);
    return true;
}

/// Writes the value of a multiplexed PDO to an object of this node.
bool Pdos::write_multiplexed(const Frame& f, std::uint16_t index, std::uint8_t sub) noexcept {
    const Entry* e = dictionary_.find(index, sub);
    return e != nullptr && e->rpdo && e->size <= 4 &&
           dictionary_.write(index, sub, {f.data.data() + 4, e->size}) == Abort::none;
}

/// Writes the value of a SAM-MPDO where the dispatching list has it. The list is 1FD0h–1FFFh; a row
/// has, from the most significant byte: block size, object of this node, node ID and object of the
/// producer (CiA 301). Returns false if the object is not in it, or could not be written.
bool Pdos::dispatch(std::uint8_t node, const Frame& f) noexcept {
    const auto index = load<std::uint16_t>(f.data.data() + 1);
    const unsigned sub = f.data[3];
    const auto first_sub = [](std::uint64_t row) { return static_cast<unsigned>(row >> 8 & 0xff); };
    const auto has_object = [&](std::uint64_t row) {
        const auto block = std::max(static_cast<unsigned>(row >> 56), 1U);
        return (row & 0xff) == node && (row >> 16 & 0xffff) == index && sub >= first_sub(row) &&
               sub < first_sub(row) + block;
    };
    for (unsigned list = 0x1fd0; list <= 0x1fff; ++list) {
        for (const auto& e : dictionary_.object(static_cast<std::uint16_t>(list))) {
            if (e.sub == 0 || e.size != 8) continue;
            const auto row = load<std::uint64_t>(e.data);
            if (!has_object(row)) continue;
            const auto to_sub = static_cast<unsigned>(row >> 32 & 0xff) + sub - first_sub(row);
            if (write_multiplexed(f, static_cast<std::uint16_t>(row >> 40),
                                  static_cast<std::uint8_t>(to_sub))) {
                return true;
            }
            break;
        }
    }
    return false;
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

// Transmission.

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
    p->pending = true;
    return true;
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
        if (!p.synchronous() || !is_due_at_sync(p, counter, counted)) continue;
        p.image = p.mapping.pack();
        if (!send(p, p.image, now)) {
            p.retry = true;
        }
    }
}

/// Counts the SYNC for a TPDO; returns true if it is sent with this one.
bool Pdos::is_due_at_sync(Tpdo& p, std::uint8_t counter, bool counted) const noexcept {
    if (p.transmission == 0) {
        const bool changed = p.on_change && p.mapping.pack() != p.last_sent;
        p.pending = p.pending || changed;
        return p.pending;
    }
    if (p.waits_for_start && counted && p.sync_start != 0) {
        if (counter != p.sync_start) return false;
        p.syncs = static_cast<std::uint8_t>(p.transmission - 1);
    }
    p.waits_for_start = false;
    if (++p.syncs < p.transmission) return false;
    p.syncs = 0;
    return true;
}

void Pdos::poll(Time now) noexcept {
    poll_interval_ = polled_ ? now - polled_at_ : 0;
    polled_ = true;
    polled_at_ = now;
    now_ = now;
    if (!operational_) return;
    for (auto& p : tpdos_) {
        if (!p.held && p.valid()) {
            poll(p, now);
        }
    }
    for (auto& p : rpdos_) {
        check_deadline(p, now);
    }
}

/// Polls are a little early or late, because an external clock reference adjusts the caller's cycle:
/// a timer has expired if the next poll would be later than its end, not only after its last
/// nanosecond. `part`: of the interval between polls.
bool Pdos::has_expired(Time since, Time timer, Time part, Time now) const noexcept {
    return now - since + std::min(poll_interval_ / part, timer / 4) >= timer;
}

void Pdos::poll(Tpdo& p, Time now) noexcept {
    if (p.kind == Kind::source_address && p.event_driven()) {
        scan(p, now);
    }
    if (p.kind != Kind::plain) return;
    if (p.retry && p.synchronous()) {
        if (window_ != 0 && now - synced_ > window_) {
            p.retry = false;
        } else {
            send(p, p.image, now);
        }
        return;
    }
    if (!p.event_driven()) return;
    if (p.on_change && !p.pending && p.mapping.pack() != p.last_sent) {
        p.pending = true;
    }
    const bool due = p.pending || (p.event != 0 && has_expired(p.last, p.event, 2, now));
    if (due && (!p.sent_once || has_expired(p.last, p.inhibit, 16, now))) {
        send(p, p.mapping.pack(), now);
    }
}

void Pdos::check_deadline(Rpdo& p, Time now) noexcept {
    if (!p.supervised || p.late || p.event == 0 || !p.valid() || now - p.last < p.event) return;
    p.late = true;
    p.supervised = false;
    emcy_.raise(0x8250, error_communication,
                {static_cast<std::uint8_t>(p.number), static_cast<std::uint8_t>(p.number >> 8)});
    events_.on_rpdo_late(p.number, now);
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

// State.

Pdos::Status Pdos::rpdo(unsigned number) const noexcept {
    const auto* p = const_cast<Pdos*>(this)->find_rpdo(number);
    if (p == nullptr) {
        return {};
    }
    return {true,     p->valid(), p->late, p->cob, p->transmission, p->mapping.bytes(),
            p->count, p->errors,  p->last};
}
Pdos::Status Pdos::tpdo(unsigned number) const noexcept {
    const auto* p = const_cast<Pdos*>(this)->find_tpdo(number);
    if (p == nullptr) {
        return {};
    }
    return {true,     p->valid(), false,  p->cob, p->transmission, p->mapping.bytes(),
            p->count, p->errors,  p->last};
}

}  // namespace hal::canopen
