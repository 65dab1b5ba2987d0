// SPDX-License-Identifier: MIT
#include "pdo.hpp"

#include <algorithm>
#include <utility>

namespace hal::canopen {

namespace {
/// Returns the PDO of this number, or nullptr.
template <class P, class Indices>
P* find(std::vector<P>& pdos, const Indices& index_of, unsigned number) noexcept {
    if (number >= index_of.size() || index_of[number] < 0) return nullptr;
    return &pdos[static_cast<std::size_t>(index_of[number])];
}

constexpr std::uint16_t rpdo_base = 0x1400;
constexpr std::uint16_t tpdo_base = 0x1800;
constexpr std::uint16_t mapping_offset = 0x200;

constexpr std::uint16_t scanner_first = 0x1fa0;
constexpr std::uint16_t scanner_last = 0x1fcf;

/// Which parameter of which PDO an object is.
struct Parameter {
    explicit Parameter(std::uint16_t index) noexcept
        : received(index < tpdo_base),
          mapping((index & mapping_offset) != 0),
          number(((index - rpdo_base) & 0x1ff) + 1U) {}
    bool received;
    bool mapping;
    unsigned number;
};

/// Returns whether a multiplexed PDO may carry the object from this node.
bool is_multiplexable(const Entry* e) noexcept { return e != nullptr && e->tpdo && e->size <= 4; }
}  // namespace

Pdos::Pdos(Dictionary& dictionary, FrameQueue& out, Emcy& emcy, DeviceEvents& events,
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
    const auto create = [&](unsigned base, unsigned n, auto& pdos, auto& index_of) {
        const auto communication = static_cast<std::uint16_t>(base + n - 1);
        const auto mapping = static_cast<std::uint16_t>(communication + mapping_offset);
        if (dictionary.find(communication, 1) == nullptr) return;
        dictionary.handle(communication, *this);
        dictionary.handle(mapping, *this);
        index_of[n] = static_cast<std::int16_t>(pdos.size());
        pdos.emplace_back(n, capacity_of(mapping));
    };
    for (unsigned n = 1; n <= max_pdos; ++n) {
        create(rpdo_base, n, rpdos_, rpdo_of_);
        create(tpdo_base, n, tpdos_, tpdo_of_);
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

Pdos::Rpdo* Pdos::find_rpdo(unsigned number) noexcept { return find(rpdos_, rpdo_of_, number); }
Pdos::Tpdo* Pdos::find_tpdo(unsigned number) noexcept { return find(tpdos_, tpdo_of_, number); }

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

/// Returns the kind that the number of mapped objects selects.
Pdos::Kind Pdos::kind_of(std::uint8_t count) noexcept {
    switch (count) {
    case 0xff: return Kind::destination_address;
    case 0xfe: return Kind::source_address;
    default: return Kind::plain;
    }
}

Abort Pdos::read_mapping(Pdo& p, bool received) noexcept {
    const auto index = static_cast<std::uint16_t>((received ? rpdo_base : tpdo_base) +
                                                  mapping_offset + p.number - 1);
    const auto count = dictionary_.get<std::uint8_t>(index, 0, 0);
    p.kind = kind_of(count);
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
        if (p.valid() && differs_in_id(cob, p.cob)) return Abort::value;
        if ((cob & cob_extended) != 0) return Abort::none;
        return abort_if(is_reserved(cob) || (cob & 0x1ffff800) != 0, Abort::value);
    }
    case 2: return abort_if(value[0] > 240 && value[0] < (received ? 254 : 252), Abort::value);
    case 3: return abort_if(p.valid() && !received, Abort::access);
    case 6:
        if (p.valid()) return Abort::access;
        return abort_if(value[0] > 240, Abort::value);
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
    if (kind_of(count) != Kind::plain) return Abort::none;
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
    return abort_if(bits > 64, Abort::pdo_length);
}

Abort Pdos::writing(Entry& e, std::span<const std::uint8_t> value) noexcept {
    if (e.index >= scanner_first) return Abort::none;
    const Parameter parameter(e.index);
    Pdo* p = nullptr;
    if (parameter.received) {
        p = find_rpdo(parameter.number);
    } else {
        p = find_tpdo(parameter.number);
    }
    if (p == nullptr) return Abort::none;
    if (parameter.mapping) return check_mapping(e, value, parameter.received, *p);
    return check_communication(e, value, parameter.received, *p);
}

void Pdos::written(Entry& e) noexcept {
    if (e.index >= scanner_first) return read_scanner_list();
    const Parameter parameter(e.index);
    Rpdo* const rpdo = find_rpdo(parameter.number);
    Tpdo* const tpdo = find_tpdo(parameter.number);
    if (parameter.received && rpdo != nullptr) {
        apply_parameter(*rpdo, parameter.mapping);
    } else if (!parameter.received && tpdo != nullptr) {
        apply_parameter(*tpdo, parameter.mapping, e.sub);
    }
    if (!parameter.mapping && e.sub == 1) {
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
                if (is_multiplexable(e) && scanned_.size() < scanned_.capacity()) {
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

/// Calls `action` for each PDO with the identifier of the frame. Returns false if there is none.
template <class List, class Heads, class Action>
static bool for_identifier(List& pdos, const Heads& heads, const Frame& f, std::size_t slot,
                           const Action& action) noexcept {
    bool found = false;
    for (auto n = heads[slot]; n >= 0; n = pdos[static_cast<std::size_t>(n)].next) {
        auto& p = pdos[static_cast<std::size_t>(n)];
        if (cob_id(p.cob) != f.id) continue;
        found = true;
        action(p);
    }
    return found;
}

bool Pdos::handle_request(const Frame& f, std::size_t slot, Time now) noexcept {
    return for_identifier(tpdos_, tpdo_heads_, f, slot, [&](Tpdo& p) {
        const bool answers = operational_ && !p.held && (p.cob & cob_flag30) == 0 &&
                             p.kind == Kind::plain && !p.synchronous();
        if (!answers) return;
        if (p.transmission != 252) {
            send(p, p.mapping.pack(), now);
        } else if (p.sampled) {
            send(p, p.image, now);
        }
    });
}

bool Pdos::handle_data(const Frame& f, std::size_t slot, Time now) noexcept {
    return for_identifier(rpdos_, rpdo_heads_, f, slot, [&](Rpdo& p) {
        if (!operational_ || p.held) return;
        const bool good =
            p.kind == Kind::plain ? receive(p, f, now) : receive_multiplexed(p, f, now);
        if (!good) {
            ++p.errors;
        }
    });
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
    if (f.length > bytes) {
        if (settings_.report_too_long) {
            p.wrong_length = true;
            emcy_.raise(0x8220, error_communication, details);
        }
        return true;
    }
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
    if (synced_ != 0 && is_after_window(now)) return false;
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

/// Polls are a little early or late, because an external clock reference adjusts the caller's
/// cycle: a timer has expired if the next poll would be later than its end, not only after its last
/// nanosecond. `part`: of the interval between polls.
bool Pdos::has_expired(Time since, Time timer, Time part, Time now) const noexcept {
    return now - since + std::min(poll_interval_ / part, timer / 4) >= timer;
}

void Pdos::poll(Tpdo& p, Time now) noexcept {
    if (p.kind == Kind::source_address && p.event_driven()) {
        scan(p, now);
    }
    if (p.kind != Kind::plain) return;
    if (p.synchronous()) return retry(p, now);
    if (!p.event_driven()) return;
    if (p.on_change && !p.pending && p.mapping.pack() != p.last_sent) {
        p.pending = true;
    }
    const bool due = p.pending || (p.event != 0 && has_expired(p.last, p.event, 2, now));
    if (due && (!p.sent_once || has_expired(p.last, p.inhibit, 16, now))) {
        send(p, p.mapping.pack(), now);
    }
}

/// Sends what did not fit into the queue at the SYNC, within the synchronous window.
void Pdos::retry(Tpdo& p, Time now) noexcept {
    if (!p.retry) return;
    if (is_after_window(now)) {
        p.retry = false;
    } else {
        send(p, p.image, now);
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
    auto* p = find_multiplexed(number, Kind::destination_address);
    if (p == nullptr) return false;
    std::array<std::uint8_t, 4> bytes{};
    store(bytes.data(), value);
    return send_multiplexed(*p, static_cast<std::uint8_t>(0x80 | (destination & 0x7f)), index, sub,
                            bytes);
}

bool Pdos::send_sam(unsigned number, std::uint16_t index, std::uint8_t sub) noexcept {
    auto* p = find_multiplexed(number, Kind::source_address);
    const Entry* e = dictionary_.find(index, sub);
    if (p == nullptr || !is_multiplexable(e)) return false;
    return send_multiplexed(*p, node_id_, index, sub, {e->data, e->size});
}

/// Returns the TPDO if it is a multiplexed one that may be sent now, or nullptr.
Pdos::Tpdo* Pdos::find_multiplexed(unsigned number, Kind kind) noexcept {
    auto* p = find_tpdo(number);
    const bool sends = p != nullptr && p->valid() && operational_ && p->kind == kind;
    return sends ? p : nullptr;
}

/// `address`: the first byte, node ID and the kind of addressing (CiA 301). Returns false if the
/// queue is full.
bool Pdos::send_multiplexed(Tpdo& p, std::uint8_t address, std::uint16_t index, std::uint8_t sub,
                            std::span<const std::uint8_t> bytes) noexcept {
    Frame f = make_frame(p.cob, 8);
    f.data[0] = address;
    store(f.data.data() + 1, index);
    f.data[3] = sub;
    std::ranges::copy(bytes, f.data.begin() + 4);
    if (!out_.push(f)) return false;
    ++p.count;
    p.last = now_;
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

Pdos::Status Pdos::status_of(const Pdo* p, bool late) noexcept {
    if (p == nullptr) return {};
    return {true,     p->valid(), late,   p->cob, p->transmission, p->mapping.bytes(),
            p->count, p->errors,  p->last};
}
Pdos::Status Pdos::rpdo(unsigned number) const noexcept {
    const auto* p = const_cast<Pdos*>(this)->find_rpdo(number);
    return status_of(p, p != nullptr && p->late);
}
Pdos::Status Pdos::tpdo(unsigned number) const noexcept {
    return status_of(const_cast<Pdos*>(this)->find_tpdo(number), false);
}

}  // namespace hal::canopen
