// SPDX-License-Identifier: MIT
// Dynamic PDO mapping (ETG.1000.6, clause 5.6.7.4): reads what the slave has, writes what differs,
// and reads it back. A slave accepts mappings either while their PDOs are not assigned, or before
// the assignment is cleared: SyncManager::assignment_first selects it.
#include <array>

#include "ethercat/master/bus.hpp"

namespace hal::ethercat::master {

namespace {

constexpr std::uint16_t assignment_of(unsigned manager) noexcept {
    return static_cast<std::uint16_t>(0x1c10 + manager);
}
constexpr std::uint32_t object_missing = 0x06020000;
constexpr std::uint32_t sub_missing = 0x06090011;

/// What comparing a list with the slave's gave.
enum class Compared : std::uint8_t { same, differs, failed };

template <class T>
Task<SdoResult> write_value(Channel& c, Bus& bus, Device& d, std::uint16_t index, unsigned sub,
                            T value) noexcept {
    std::array<std::uint8_t, sizeof(T)> bytes{};
    put(bytes.data(), value);
    const SdoResult r =
        co_await bus.coe.download(c, d.slave, index, static_cast<std::uint8_t>(sub), false, bytes);
    if (!r) {
        bus.report(Event::mapping_failed, d,
                   static_cast<std::int64_t>(value) << 24 | index << 8 | static_cast<int>(sub),
                   event_code(r));
    }
    co_return r;
}

/// Reads a sub-index. A missing object is an empty list (facts: outputs-only devices have no
/// 1C13h).
Task<SdoResult> read_value(Channel& c, Bus& bus, Device& d, std::uint16_t index, unsigned sub,
                           std::uint32_t& value) noexcept {
    std::array<std::uint8_t, 8> bytes{};
    value = 0;
    SdoResult r =
        co_await bus.coe.upload(c, d.slave, index, static_cast<std::uint8_t>(sub), false, bytes);
    if (r) {
        value = get<std::uint32_t>(bytes.data());
    }
    if (!r && r.outcome == SdoResult::Outcome::aborted && sub == 0 &&
        (r.abort == object_missing || r.abort == sub_missing)) {
        r.outcome = SdoResult::Outcome::done;
    }
    co_return r;
}

/// Compares `count` values of an object with those of `want(n)`, n from 0.
template <class Want>
Task<Compared> compare(Channel& c, Bus& bus, Device& d, std::uint16_t index, std::size_t count,
                       Want want, bool report) noexcept {
    std::uint32_t value = 0;
    SdoResult r = co_await read_value(c, bus, d, index, 0, value);
    if (!r) {
        bus.report(Event::mapping_failed, d, index << 8, event_code(r));
        co_return Compared::failed;
    }
    if ((value & 0xff) != count) {
        if (report) {
            bus.report(Event::mapping_differs, d,
                       static_cast<std::int64_t>(count) << 24 | index << 8, value & 0xff);
        }
        co_return Compared::differs;
    }
    for (std::size_t n = 0; n < count; ++n) {
        r = co_await read_value(c, bus, d, index, static_cast<unsigned>(n + 1), value);
        const bool same = r && value == want(n);
        if (same) continue;
        if (report) {
            bus.report(
                Event::mapping_differs, d,
                static_cast<std::int64_t>(want(n)) << 24 | index << 8 | static_cast<int>(n + 1),
                value);
        }
        co_return Compared::differs;
    }
    co_return Compared::same;
}

Task<Compared> compare_mapping(Channel& c, Bus& bus, Device& d, const Pdo& pdo,
                               bool report) noexcept {
    const auto want = [&pdo](std::size_t n) { return pdo.mapping(n); };
    return compare(c, bus, d, pdo.index, pdo.mapped(), want, report);
}

Task<Compared> compare_assignment(Channel& c, Bus& bus, Device& d, const SyncManager& sm,
                                  bool report) noexcept {
    const auto want = [&sm](std::size_t n) { return std::uint32_t{sm.pdos[n].index}; };
    return compare(c, bus, d, assignment_of(sm.number), sm.pdos.size(), want, report);
}

/// Writes a list at once: sub-index 0 padded to 16 bits, then the values.
template <class T, class Want>
Task<SdoResult> write_complete(Channel& c, Bus& bus, Device& d, std::uint16_t index,
                               std::size_t count, Want want) noexcept {
    std::array<std::uint8_t, 2 + 255 * sizeof(T)> bytes{};
    bytes[0] = static_cast<std::uint8_t>(count);
    for (std::size_t n = 0; n < count; ++n) {
        put(&bytes[2 + n * sizeof(T)], static_cast<T>(want(n)));
    }
    const SdoResult r = co_await bus.coe.download(c, d.slave, index, 0, true,
                                                  {bytes.data(), 2 + count * sizeof(T)});
    co_return r;
}

/// Writes a list: count 0 unless it is `cleared`, the values, the count.
template <class T, class Want>
Task<bool> write_list(Channel& c, Bus& bus, Device& d, std::uint16_t index, std::size_t count,
                      Want want, bool cleared) noexcept {
    SdoResult r;
    if (d.slave.complete_access && (d.slave.coe_details & 0x20) != 0) {
        r = co_await write_complete<T>(c, bus, d, index, count, want);
        if (r) co_return true;
    }
    if (!cleared) {
        r = co_await write_value<std::uint8_t>(c, bus, d, index, 0, 0);
        if (!r) co_return false;
    }
    for (std::size_t n = 0; n < count; ++n) {
        r = co_await write_value(c, bus, d, index, static_cast<unsigned>(n + 1),
                                 static_cast<T>(want(n)));
        if (!r) co_return false;
    }
    if (count == 0) co_return true;
    r = co_await write_value(c, bus, d, index, 0, static_cast<std::uint8_t>(count));
    co_return static_cast<bool>(r);
}

/// A bit for each of the first 64 PDOs of a sync manager.
using PdoSet = std::uint64_t;

Task<bool> write_mappings(Channel& c, Bus& bus, Device& d, const SyncManager& sm,
                          PdoSet which) noexcept {
    for (std::size_t n = 0; n < sm.pdos.size(); ++n) {
        if ((which >> n & 1) == 0) continue;
        const Pdo& pdo = sm.pdos[n];
        const auto want = [&pdo](std::size_t entry) { return pdo.mapping(entry); };
        const bool ok =
            co_await write_list<std::uint32_t>(c, bus, d, pdo.index, pdo.mapped(), want, false);
        if (!ok) co_return false;
        const Compared now = co_await compare_mapping(c, bus, d, pdo, true);
        if (now != Compared::same) co_return false;
    }
    co_return true;
}

/// Finds the PDOs whose mapping has to be written. `limit`: entries that a PDO of the slave can
/// have, 0: unknown. Returns false when that failed; it is reported.
Task<bool> find_differing(Channel& c, Bus& bus, Device& d, const SyncManager& sm, unsigned limit,
                          PdoSet& differing) noexcept {
    constexpr std::size_t max_pdos = 64;
    constexpr std::size_t max_entries = 254;
    for (std::size_t n = 0; n < sm.pdos.size() && n < max_pdos; ++n) {
        const Pdo& pdo = sm.pdos[n];
        if (!pdo.write_mapping) continue;
        if (pdo.mapped() > max_entries || (limit != 0 && pdo.mapped() > limit)) {
            bus.report(Event::too_many_entries, d, pdo.index,
                       static_cast<std::int64_t>(pdo.mapped()));
            co_return false;
        }
        const Compared now = co_await compare_mapping(c, bus, d, pdo, false);
        if (now == Compared::failed) co_return false;
        if (now == Compared::differs) {
            differing |= PdoSet{1} << n;
        }
    }
    co_return true;
}

/// A mapping changes only while its PDO is not assigned: slaves that check this have their
/// assignment cleared first, and written after any change.
Task<bool> write_assignment(Channel& c, Bus& bus, Device& d, const SyncManager& sm) noexcept {
    const auto want = [&sm](std::size_t n) { return sm.pdos[n].index; };
    const bool ok = co_await write_list<std::uint16_t>(c, bus, d, assignment_of(sm.number),
                                                       sm.pdos.size(), want, sm.assignment_first);
    if (!ok) co_return false;
    const Compared now = co_await compare_assignment(c, bus, d, sm, true);
    co_return now == Compared::same;
}

/// Writes the PDO mapping and the assignment of a sync manager where they differ from the setup.
/// Returns false when that failed; it is reported. `limit`: see find_differing().
Task<bool> map_manager(Channel& c, Bus& bus, Device& d, const SyncManager& sm,
                       unsigned limit) noexcept {
    PdoSet differing = 0;
    const bool found = co_await find_differing(c, bus, d, sm, limit, differing);
    if (!found) co_return false;
    // the assignment is written in any case when it is cleared before a mapping
    bool assign = differing != 0 && sm.assignment_first;
    if (sm.write_assignment && !assign) {
        const Compared now = co_await compare_assignment(c, bus, d, sm, false);
        if (now == Compared::failed) co_return false;
        assign = now == Compared::differs;
    }
    if (differing == 0 && !assign) co_return true;

    if (sm.assignment_first) {
        const SdoResult cleared =
            co_await write_value<std::uint8_t>(c, bus, d, assignment_of(sm.number), 0, 0);
        if (!cleared) co_return false;
    }
    const bool mapped = co_await write_mappings(c, bus, d, sm, differing);
    if (!mapped) co_return false;
    if (!assign) co_return true;
    const bool assigned = co_await write_assignment(c, bus, d, sm);
    co_return assigned;
}

/// Compares the process data of a slave that cannot change it with what its SII states; 0 bytes
/// there: not stated.
bool has_fixed_size(Bus& bus, Device& d, const SyncManager& sm) noexcept {
    std::size_t bits = 0;
    for (const Pdo& pdo : sm.pdos) {
        for (const Entry& e : pdo.entries) {
            bits += e.bits;
        }
    }
    if (d.slave.sii_sync_managers != 0 && sm.number >= d.slave.sii_sync_managers) {
        bus.report(Event::too_few_sync_managers, d, d.slave.sii_sync_managers, sm.number + 1);
        return false;
    }
    const std::size_t fixed =
        sm.number < d.slave.sii_sync_managers ? d.slave.sii[sm.number].length : 0;
    if (fixed == 0 || fixed == (bits + 7) / 8) return true;
    bus.report(Event::fixed_size, d, sm.number << 16 | static_cast<std::int64_t>((bits + 7) / 8),
               static_cast<std::int64_t>(fixed));
    return false;
}

}  // namespace

Task<bool> map_process_data(Channel& c, Bus& bus, Device& d) noexcept {
    const Slave& config = *bus.config(d);
    for (const SyncManager& sm : config.sync_managers) {
        bool any = sm.write_assignment;
        for (const Pdo& pdo : sm.pdos) {
            any |= pdo.write_mapping;
        }
        if (!any) continue;
        if (sm.number >= d.slave.sync_managers) {
            bus.report(Event::too_few_sync_managers, d, d.slave.sync_managers, sm.number + 1);
            co_return false;
        }
        if (!d.slave.mailbox.usable() || (d.slave.protocols & bit_of(MailboxType::coe)) == 0) {
            if (!has_fixed_size(bus, d, sm)) co_return false;
            continue;
        }
        const bool ok = co_await map_manager(c, bus, d, sm, config.entries_per_pdo);
        if (!ok) co_return false;
    }
    co_return true;
}

}  // namespace hal::ethercat::master
