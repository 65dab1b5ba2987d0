// SPDX-License-Identifier: MIT
// The parameters of PDOs: reading them, and checking what is written to them. pdo_receive.cpp and
// pdo_send.cpp carry the data.
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
        const auto id = cob_id(cob);
        return (cob & cob_extended) == 0 &&
                       (restricted(id) || id == 0x80 || (cob & 0x1ffff800) != 0)
                   ? Abort::value
                   : Abort::none;
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
    if (received) {
        if (auto* p = find_rpdo(number); p != nullptr) {
            if (mapping) {
                read_mapping(*p, true);
            } else {
                read_communication(*p);
                p->supervised = p->late = p->fresh = false;
            }
        }
    } else if (auto* p = find_tpdo(number); p != nullptr) {
        const bool was_valid = p->valid();
        if (mapping) {
            read_mapping(*p, false);
        } else {
            read_communication(*p);
        }
        if (e.sub == 2 || (p->valid() && !was_valid)) {
            restart(*p, now_);
        }
    }
    if (!mapping && e.sub == 1) {
        index_identifiers();
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
