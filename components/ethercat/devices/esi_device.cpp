// SPDX-License-Identifier: MIT
#include "ethercat/devices/esi_device.hpp"

#include <algorithm>
#include <map>
#include <set>

#include "text/numbers.hpp"

namespace hal::ethercat::devices {
namespace {

namespace access = coe::access;

struct PlannedEntry {
    std::string name;
    std::uint16_t type = 0;
    std::uint16_t bits = 0;
    std::uint16_t rights = 0;
    std::vector<std::uint8_t> initial;
};
struct PlannedObject {
    std::string name;
    std::uint16_t type = 0;
    coe::ObjectCode code = coe::ObjectCode::variable;
    std::map<std::uint8_t, PlannedEntry> entries;
};
using Plan = std::map<std::uint16_t, PlannedObject>;

/// Returns whether an object follows from the PDOs, the sync managers or the identity.
bool is_derived(std::uint16_t index) {
    return (index >= coe::rx_pdo && index < coe::rx_pdo + 0x200) ||
           (index >= coe::tx_pdo && index < coe::tx_pdo + 0x200) ||
           (index >= coe::sync_manager_types && index < coe::assignment + 0x10) || index == 0x1018;
}

void add_objects(const esi::Device& device, Plan& plan) {
    for (const esi::Object& o : device.objects) {
        if (is_derived(o.index)) continue;
        PlannedObject& to = plan[o.index];
        to.name = o.name;
        to.type = sii::type_number(o.type);

        to.code = static_cast<coe::ObjectCode>(o.code);
        for (const esi::Value& v : o.values) {
            const auto when = [](bool is, unsigned right) { return is ? right : 0U; };
            const unsigned rights =
                when(v.readable, access::read) | when(v.writable, access::write) |
                when(v.rx_mappable, access::rx_mappable) | when(v.tx_mappable, access::tx_mappable);
            to.entries[v.sub] = {v.name, sii::type_number(v.type),
                                 static_cast<std::uint16_t>(std::min(v.bits, 0xffffU)),
                                 static_cast<std::uint16_t>(rights), v.initial};
        }
    }
}

/// Adds the objects of PDOs that are missing in the dictionary of the description, and their right
/// to be mapped.
void add_mapped(const std::vector<esi::Pdo>& pdos, bool output, Plan& plan) {
    for (const esi::Pdo& pdo : pdos) {
        for (const esi::Entry& e : pdo.entries) {
            if (e.index == 0) continue;
            PlannedObject& object = plan[e.index];
            if (object.entries.empty()) {
                object.name = pdo.name.empty() ? e.name : pdo.name;
            }
            PlannedEntry& entry = object.entries[e.sub];
            if (entry.name.empty()) {
                entry.name = e.name;
            }
            if (entry.bits != e.bits) {
                entry.bits = e.bits;
                entry.type = sii::type_number(e.type);
                entry.initial.clear();
            }
            entry.rights |=
                static_cast<std::uint16_t>(output ? access::read_write | access::rx_mappable
                                                  : access::read | access::tx_mappable);
            if (e.sub != 0 && object.code == coe::ObjectCode::variable) {
                object.code = coe::ObjectCode::record;
            }
        }
    }
}

void write_dictionary(const Plan& plan, Dictionary& d) {
    for (const auto& [index, object] : plan) {
        if (object.code == coe::ObjectCode::variable) {
            const PlannedEntry& e = object.entries.begin()->second;
            d.object(index, object.name, object.code, object.type != 0 ? object.type : e.type);
            d.entry(0, e.name.empty() ? object.name : e.name, e.type, e.bits, e.rights, e.initial);
            continue;
        }
        d.object(index, object.name, object.code, object.type);
        const std::uint8_t last =
            object.entries.empty() ? std::uint8_t{0} : object.entries.rbegin()->first;
        d.entry(0, "Number of entries", coe::type::u8, 8, access::read, std::span(&last, 1));
        for (const auto& [sub, e] : object.entries) {
            if (sub != 0) {
                d.entry(sub, e.name, e.type, e.bits, e.rights, e.initial);
            }
        }
    }
}

/// Adds the mappings of PDOs, and returns which are there; a number that occurs twice counts once.
void add_pdos(const std::vector<esi::Pdo>& pdos, bool configurable, Dictionary& d,
              std::set<std::uint16_t>& done) {
    constexpr std::size_t most = 32;  // entries of a PDO that can be mapped anew
    for (const esi::Pdo& pdo : pdos) {
        if (!done.insert(pdo.index).second) continue;
        const bool writable = configurable && !pdo.fixed;
        const std::uint16_t rights = writable ? access::read | access::write_preop : access::read;
        std::vector<std::uint32_t> mapped;
        for (const esi::Entry& e : pdo.entries) {
            mapped.push_back(coe::Mapping{e.index, e.index == 0 ? std::uint8_t{0} : e.sub,
                                          static_cast<std::uint8_t>(e.bits)}
                                 .raw());
        }
        if (mapped.size() > 254) {
            mapped.resize(254);
        }
        d.record(pdo.index, pdo.name, static_cast<std::uint8_t>(mapped.size()),
                 coe::ObjectCode::record, rights, coe::type::pdo_mapping);
        for (std::size_t n = 0; n < std::max(writable ? most : 0, mapped.size()); ++n) {
            d.sub(static_cast<std::uint8_t>(n + 1), "Mapping " + std::to_string(n + 1),
                  coe::type::u32, rights, n < mapped.size() ? mapped[n] : 0);
        }
    }
}

/// Adds the assignment of a sync manager; returns the bytes of the assigned PDOs.
std::size_t add_assignment(const std::vector<esi::Pdo>& pdos, unsigned number, bool writable,
                           Dictionary& d) {
    const std::uint16_t rights = writable ? access::read | access::write_preop : access::read;
    std::vector<std::uint16_t> assigned;
    std::size_t bits = 0;
    for (const esi::Pdo& pdo : pdos) {
        if (pdo.sync_manager == number &&
            std::find(assigned.begin(), assigned.end(), pdo.index) == assigned.end()) {
            assigned.push_back(pdo.index);
            bits += pdo.bits();
        }
    }
    d.record(static_cast<std::uint16_t>(coe::assignment + number),
             "PDO assignment of sync manager " + std::to_string(number),
             static_cast<std::uint8_t>(assigned.size()), coe::ObjectCode::array, rights,
             coe::type::u16);
    const std::size_t slots = std::min<std::size_t>(
        writable ? std::max(pdos.size(), assigned.size()) : assigned.size(), 254);
    for (std::size_t n = 0; n < slots; ++n) {
        d.sub(static_cast<std::uint8_t>(n + 1), "PDO " + std::to_string(n + 1), coe::type::u16,
              rights, n < assigned.size() ? assigned[n] : 0);
    }
    return (bits + 7) / 8;
}

void add_identity(const sii::Contents& s, Plan& plan) {
    const auto number = [](std::uint32_t value) {
        std::vector<std::uint8_t> bytes(4);
        put(bytes.data(), value);
        return bytes;
    };
    PlannedObject& identity = plan[0x1018];
    identity = {"Identity", coe::type::identity, coe::ObjectCode::record, {}};
    const std::pair<const char*, std::uint32_t> values[] = {{"Vendor ID", s.vendor},
                                                            {"Product code", s.product},
                                                            {"Revision", s.revision},
                                                            {"Serial number", s.serial}};
    for (std::uint8_t n = 0; n < 4; ++n) {
        identity.entries[n + 1] = {values[n].first, coe::type::u32, 32, access::read,
                                   number(values[n].second)};
    }
    if (!plan.contains(0x1000)) {
        plan[0x1000] = {"Device type", coe::type::u32, coe::ObjectCode::variable, {}};
    }
    if (!plan.contains(0x1001)) {
        plan[0x1001] = {"Error register", coe::type::u8, coe::ObjectCode::variable, {}};
    }
    if (plan[0x1000].entries.empty()) {
        plan[0x1000].entries[0] = {"Device type", coe::type::u32, 32, access::read, {}};
    }
    if (plan[0x1001].entries.empty()) {
        plan[0x1001].entries[0] = {"Error register", coe::type::u8, 8, access::read, {}};
    }
}

}  // namespace

std::string why_not_emulated(const esi::Device& d) {
    for (const sii::SmType type : {sii::SmType::outputs, sii::SmType::inputs}) {
        unsigned used = 0;
        for (std::size_t n = 0; n < d.sync_managers.size(); ++n) {
            used += d.sync_managers[n].type == type ? 1 : 0;
        }
        if (used > 1) {
            return std::string("several sync managers with ") +
                   (type == sii::SmType::outputs ? "outputs" : "inputs") + " are not emulated";
        }
    }
    for (const esi::SyncManager& s : d.sync_managers) {
        if ((s.type == sii::SmType::mailbox_out || s.type == sii::SmType::mailbox_in) &&
            s.default_size > largest_mailbox) {
            return "a mailbox of " + std::to_string(s.default_size) +
                   " bytes is longer than a datagram";
        }
    }
    return {};
}

Parts make_esi_device(const DeviceOptions& o) {
    const esi::Device& device = *o.described;
    Design design;
    design.name = device.order;
    design.sii = esi::sii_contents(device);
    sii::Contents& s = design.sii;
    s.configuration[4] = o.alias;
    design.device_id = o.alias;
    if (o.serial != 0) {
        s.serial = o.serial;
    }
    if (s.general.ports == std::array<std::uint8_t, 4>{}) {
        s.general.ports = {1, 1, 0, 0};
    }
    design.coe = s.has_mailbox() && (s.protocols & bit_of(MailboxType::coe)) != 0;
    design.dc = device.has_dc;
    const bool configurable = design.coe && (s.general.coe_details & sii::coe_pdo_config) != 0;
    const bool assignable = design.coe && (s.general.coe_details & sii::coe_pdo_assign) != 0;

    Plan plan;
    add_objects(device, plan);
    add_mapped(device.rx, true, plan);
    add_mapped(device.tx, false, plan);
    add_identity(s, plan);
    PlannedObject& types = plan[coe::sync_manager_types];
    types = {"Sync manager types", coe::type::u8, coe::ObjectCode::array, {}};
    for (std::size_t n = 0; n < s.sync_managers.size(); ++n) {
        types.entries[static_cast<std::uint8_t>(n + 1)] = {
            "Sync manager " + std::to_string(n),
            coe::type::u8,
            8,
            access::read,
            {static_cast<std::uint8_t>(s.sync_managers[n].type)}};
    }
    Dictionary& d = *design.dictionary;
    write_dictionary(plan, d);
    std::set<std::uint16_t> done;
    add_pdos(device.rx, configurable, d, done);
    add_pdos(device.tx, configurable, d, done);
    for (unsigned n = 0; n < s.sync_managers.size(); ++n) {
        const bool output = s.sync_managers[n].type == sii::SmType::outputs;
        if (!output && s.sync_managers[n].type != sii::SmType::inputs) continue;
        const std::size_t bytes = add_assignment(output ? device.rx : device.tx, n, assignable, d);
        s.sync_managers[n].length = static_cast<std::uint16_t>(bytes);
        const std::size_t most = std::max<std::size_t>(bytes, device.sync_managers[n].max_size);
        (output ? design.max_output_bytes : design.max_input_bytes) =
            configurable || assignable ? std::max<std::size_t>(most, 128) : most;
    }
    d.finish();
    return {std::move(design), std::make_unique<Idle>()};
}

}  // namespace hal::ethercat::devices
