// SPDX-License-Identifier: MIT
#include "ethercat/devices/esi_device.hpp"

#include <algorithm>
#include <bit>
#include <limits>
#include <map>
#include <set>

#include "ethercat/devices/aoe_server.hpp"
#include "ethercat/devices/eoe_host.hpp"
#include "ethercat/devices/foe_server.hpp"
#include "ethercat/devices/sampled_io.hpp"
#include "ethercat/devices/soe_server.hpp"
#include "text/characters.hpp"

namespace hal::ethercat::devices {
namespace {

namespace access = coe::access;

constexpr std::uint16_t sync_manager_count = 15;
constexpr std::size_t usual_max_bytes = 128;  ///< of process data that can be mapped anew

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

bool is_mapping(std::uint16_t index) {
    return (index >= coe::rx_pdo && index < coe::rx_pdo + 0x200) ||
           (index >= coe::tx_pdo && index < coe::tx_pdo + 0x200);
}

/// Returns whether an object follows from the PDOs, the sync managers or the identity.
bool is_derived(std::uint16_t index) {
    return is_mapping(index) ||
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

/// Returns the entries of an object that is known by a write with complete access only: equal ones,
/// as many as sub-index 0 counts.
void add_complete(const esi::InitCmd& command, PlannedObject& object) {
    constexpr std::size_t count_bytes = 2;
    object.code = coe::ObjectCode::record;
    if (command.data.size() <= count_bytes) return;
    const std::size_t bytes = command.data.size() - count_bytes;
    const std::size_t count = command.data[0];
    const bool equal = count != 0 && bytes % count == 0;
    const std::size_t entries = equal ? count : 1;
    for (std::size_t n = 1; n <= entries; ++n) {
        object.entries[static_cast<std::uint8_t>(n)] = {
            "", 0, static_cast<std::uint16_t>(8 * bytes / entries), access::read_write, {}};
    }
}

/// Adds an entry for what a write with complete access has beyond the last one.
void add_rest(const esi::InitCmd& command, PlannedObject& object) {
    std::size_t bits = command.sub == 0 ? 16 : 0;
    for (const auto& [sub, entry] : object.entries) {
        bits += sub != 0 ? entry.bits : 0U;
    }
    const std::size_t written = 8 * command.data.size();
    if (written <= bits || object.entries.rbegin()->first == 0xff) return;
    const auto next = static_cast<std::uint8_t>(object.entries.rbegin()->first + 1);
    object.entries[next] = {
        "", 0, static_cast<std::uint16_t>(written - bits), access::read_write, {}};
}

/// Adds what the start-up commands write: objects that are missing in the dictionary, and the right
/// to write those that have it not.
void add_commands(const esi::Device& device, Plan& plan) {
    for (const esi::InitCmd& command : device.init_commands) {
        if (command.protocol != esi::InitCmd::Protocol::coe || command.data.empty() ||
            is_derived(command.index)) {
            continue;
        }
        const bool is_new = !plan.contains(command.index);
        PlannedObject& object = plan[command.index];
        if (is_new) {
            object.name = command.comment;
        }
        if (command.complete) {
            if (is_new) {
                add_complete(command, object);
            } else if (object.code != coe::ObjectCode::variable && !object.entries.empty()) {
                add_rest(command, object);
            }
            continue;
        }
        PlannedEntry& entry = object.entries[command.sub];
        const auto bits = static_cast<std::uint16_t>(std::min<std::size_t>(
            8 * command.data.size(), std::numeric_limits<std::uint16_t>::max()));
        // what a PDO maps is never shortened
        const bool is_mapped = (entry.rights & (access::rx_mappable | access::tx_mappable)) != 0;
        const unsigned bytes = (entry.bits + 7U) / 8;
        if (bytes < command.data.size() || (bytes > command.data.size() && !is_mapped)) {
            entry.bits = bits;
            entry.type = 0;
            entry.initial.clear();
        }
        entry.rights |= access::read_write;
        if (command.sub != 0) {
            object.code =
                object.code == coe::ObjectCode::variable ? coe::ObjectCode::record : object.code;
        }
    }
}

/// Returns whether a start-up command writes an object of a range.
bool is_commanded(const esi::Device& device, std::uint16_t first, std::uint16_t last) {
    return std::any_of(device.init_commands.begin(), device.init_commands.end(),
                       [=](const esi::InitCmd& c) {
        return c.protocol == esi::InitCmd::Protocol::coe && c.index >= first && c.index <= last;
    });
}

/// Adds the configured and the detected module list (ETG.5001).
void add_module_lists(const std::vector<std::uint32_t>& idents, Plan& plan) {
    for (const std::uint16_t index : {std::uint16_t{0xf030}, std::uint16_t{0xf050}}) {
        const bool is_detected = index == 0xf050;
        PlannedObject& list = plan[index];
        list = {is_detected ? "Detected modules" : "Configured modules",
                coe::type::u32,
                coe::ObjectCode::array,
                {}};
        list.entries[0] = {"Number of entries",
                           coe::type::u8,
                           8,
                           is_detected ? access::read : access::read_write,
                           {static_cast<std::uint8_t>(is_detected ? idents.size() : 0)}};
        for (std::size_t n = 0; n < idents.size(); ++n) {
            std::vector<std::uint8_t> ident(4);
            put(ident.data(), is_detected ? idents[n] : 0U);
            list.entries[static_cast<std::uint8_t>(n + 1)] = {
                "Module " + std::to_string(n + 1), coe::type::u32, 32,
                is_detected ? access::read : access::read_write, ident};
        }
    }
}

/// Returns the attribute and the value of a parameter of `bytes` bytes, at most 8.
Idn plain_idn(std::uint8_t drive, std::uint16_t number, const std::string& name,
              std::size_t bytes) {
    const std::size_t width = std::bit_width(std::bit_ceil(std::max<std::size_t>(bytes, 1))) - 1U;
    const std::size_t limited = std::min<std::size_t>(width, 3);
    Idn idn;
    idn.drive = drive;
    idn.number = number;
    idn.name = name;
    idn.attribute.raw = static_cast<std::uint32_t>(limited) << 16;
    idn.value.resize(std::size_t{1} << limited);
    idn.length = idn.value.size();
    return idn;
}

/// Adds the telegram of a drive: the list of its parameters (S-0-0016 of the AT, S-0-0024 of the
/// MDT), and these parameters. The first entry, control or status word, is not in the list
/// (IEC 61800-7-204). The index of a PDO is the list's number, with the drive in bits 12 to 14.
void add_telegram(const esi::Pdo& pdo, std::uint16_t list_number, std::vector<Idn>& idns) {
    constexpr std::uint16_t number_bits = 0xfff;
    if ((pdo.index & number_bits) != list_number || pdo.entries.empty()) return;
    const auto drive = static_cast<std::uint8_t>((pdo.index >> 12) & 7);
    const auto is_known = [&](std::uint16_t number) {
        return std::any_of(idns.begin(), idns.end(), [&](const Idn& idn) {
            return idn.drive == drive && idn.number == number;
        });
    };
    Idn list;
    list.drive = drive;
    list.number = list_number;
    list.name = pdo.name;
    list.attribute.raw = soe::attribute::list | soe::attribute::bytes_2 | soe::attribute::idn;
    for (std::size_t n = 0; n < pdo.entries.size(); ++n) {
        const esi::Entry& entry = pdo.entries[n];
        if (n != 0) {
            list.value.resize(list.value.size() + 2);
            put(&list.value[list.value.size() - 2], entry.index);
        }
        if (!is_known(entry.index)) {
            idns.push_back(plain_idn(drive, entry.index, entry.name, (entry.bits + 7U) / 8));
        }
    }
    list.length = list.value.size();
    if (!is_known(list_number)) idns.push_back(std::move(list));
}

/// Returns the parameters that the start-up commands write, and those of the telegrams.
std::vector<Idn> idns_of(const esi::Device& device) {
    std::vector<Idn> idns;
    for (const esi::InitCmd& command : device.init_commands) {
        const std::size_t size = command.data.size();
        if (command.protocol != esi::InitCmd::Protocol::soe || size == 0) continue;
        Idn idn = plain_idn(command.sub, command.index, command.comment, size);
        if (size >= 4 && get<std::uint16_t>(command.data.data()) == size - 4) {
            idn.attribute.raw = soe::attribute::list | soe::attribute::bytes_2;
            idn.value.assign(command.data.begin() + 4, command.data.end());
            idn.length = idn.value.size();
        }
        idns.push_back(std::move(idn));
    }
    for (const esi::Pdo& pdo : device.tx) {
        add_telegram(pdo, soe::idn_at_list, idns);
    }
    for (const esi::Pdo& pdo : device.rx) {
        add_telegram(pdo, soe::idn_mdt_list, idns);
    }
    return idns;
}

/// Adds the objects of PDOs that are missing in the dictionary of the description, and their right
/// to be mapped. A description that names a mapping itself as an object of a PDO has no such
/// object: these bits are a gap.
void add_mapped(const std::vector<esi::Pdo>& pdos, bool output, Plan& plan) {
    for (const esi::Pdo& pdo : pdos) {
        for (const esi::Entry& e : pdo.entries) {
            if (e.index == 0 || is_mapping(e.index)) continue;
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
        const auto count = object.entries.find(0);
        const std::uint16_t count_rights =
            count == object.entries.end() ? std::uint16_t{0} : count->second.rights;
        d.entry(0, "Number of entries", coe::type::u8, 8,
                static_cast<std::uint16_t>(access::read | count_rights), std::span(&last, 1));
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
    constexpr std::size_t max = 32;  // entries of a PDO that can be mapped anew
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
        for (std::size_t n = 0; n < std::max(writable ? max : 0, mapped.size()); ++n) {
            d.sub(static_cast<std::uint8_t>(n + 1), "Mapping " + std::to_string(n + 1),
                  coe::type::u32, rights, n < mapped.size() ? mapped[n] : 0);
        }
    }
}

/// Adds the mappings that only start-up commands name, without entries.
void add_commanded_pdos(const esi::Device& device, Dictionary& d, std::set<std::uint16_t>& done) {
    std::vector<esi::Pdo> pdos;
    for (const esi::InitCmd& command : device.init_commands) {
        const bool is_coe = command.protocol == esi::InitCmd::Protocol::coe;
        if (!is_coe || !is_mapping(command.index) || done.contains(command.index)) continue;
        esi::Pdo& pdo = pdos.emplace_back();
        pdo.index = command.index;
        pdo.name = command.comment;
    }
    add_pdos(pdos, true, d, done);
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

/// Adds 1C12h and 1C13h where no sync manager of process data has that number: masters write them
/// in every device.
void add_empty_assignments(const sii::Contents& s, Dictionary& d) {
    for (unsigned n = 2; n <= 3; ++n) {
        const sii::SmType type =
            n < s.sync_managers.size() ? s.sync_managers[n].type : sii::SmType::unused;
        if (type == sii::SmType::outputs || type == sii::SmType::inputs) continue;
        d.record(static_cast<std::uint16_t>(coe::assignment + n),
                 "PDO assignment of sync manager " + std::to_string(n), 0, coe::ObjectCode::array,
                 access::read | access::write_preop, coe::type::u16);
        d.limit(0, 0);
    }
}

/// Assigns the PDOs of the default operation mode, in its order, if it names numbers of samples:
/// such a device follows the modes rather than the attributes of its PDOs.
void assign_by_mode(esi::Device& device) {
    if (device.op_modes.empty() || device.op_modes.front().samples() == 0) return;
    for (auto* pdos : {&device.rx, &device.tx}) {
        for (esi::Pdo& pdo : *pdos) {
            pdo.sync_manager.reset();
        }
        auto next = pdos->begin();
        for (const esi::OpMode::Assigned& one : device.op_modes.front().assigned) {
            const auto at = std::find_if(next, pdos->end(),
                                         [&](const esi::Pdo& p) { return p.index == one.pdo; });
            if (at == pdos->end()) continue;
            at->sync_manager = one.sync_manager;
            std::rotate(next, at, at + 1);
            ++next;
        }
    }
}

/// Returns the PDOs of a device that have several samples in a cycle.
SampledPdos sampled_pdos(const esi::Device& device) {
    SampledPdos out;
    for (const auto* pdos : {&device.rx, &device.tx}) {
        for (const esi::Pdo& pdo : *pdos) {
            if (!pdo.oversampling) continue;
            out.indices.push_back(pdo.index);
            out.max_samples = std::max(out.max_samples, pdo.oversampling.max);
        }
    }
    return out;
}

/// Returns how many bytes the PDOs of a sync manager have with all their samples.
std::size_t max_sampled_bytes(const std::vector<esi::Pdo>& pdos, unsigned number) {
    std::size_t bits = 0;
    for (const esi::Pdo& pdo : pdos) {
        if (pdo.sync_manager == number) {
            bits += std::size_t{pdo.bits()} * std::max(pdo.oversampling.max, 1U);
        }
    }
    return (bits + 7) / 8;
}

/// Returns the entries of PDOs with samples, and of other PDOs those that count cycles.
struct SampledEntries {
    std::vector<SampledEntry> values, counters;
};
SampledEntries sampled_entries(const std::vector<esi::Pdo>& pdos, Dictionary& d) {
    SampledEntries out;
    for (const esi::Pdo& pdo : pdos) {
        for (const esi::Entry& e : pdo.entries) {
            const DictionaryEntry* const object = e.index != 0 ? d.find(e.index, e.sub) : nullptr;
            if (object == nullptr || object->bits < e.bits || e.bits == 0 || e.bits > 64) continue;
            const bool is_signed = e.type.ends_with("INT") && !e.type.starts_with("U");
            const SampledEntry entry{d.data(*object), e.bits, is_signed};
            if (pdo.oversampling) {
                out.values.push_back(entry);
            } else if (lower(e.name).find("cyclecount") != std::string::npos) {
                out.counters.push_back(entry);
            }
        }
    }
    return out;
}

std::unique_ptr<Behaviour> behaviour_of(const esi::Device& device, const Design& design) {
    if (design.sampled.indices.empty()) return std::make_unique<Idle>();
    SampledEntries inputs = sampled_entries(device.tx, *design.dictionary);
    SampledEntries outputs = sampled_entries(device.rx, *design.dictionary);
    return std::make_unique<SampledIo>(design.dictionary, std::move(inputs.values),
                                       std::move(outputs.values), std::move(inputs.counters));
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

void add_sync_manager_types(const sii::Contents& s, Plan& plan) {
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
}

/// The messages of VoE are defined by each maker.
bool is_emulated(MailboxType type) { return type != MailboxType::voe; }

/// Returns the server of a protocol; null for CoE, which the firmware serves itself, and for a
/// protocol that is not emulated.
std::unique_ptr<MailboxService> service_of(MailboxType type, const esi::Device& device,
                                           const std::shared_ptr<Dictionary>& dictionary) {
    switch (type) {
    case MailboxType::aoe: return std::make_unique<AoeServer>(dictionary);
    case MailboxType::eoe: return std::make_unique<EoeHost>();
    case MailboxType::foe: {
        auto files = std::make_unique<FoeServer>();
        files->accept_new();
        return files;
    }
    case MailboxType::soe: return std::make_unique<SoeServer>(idns_of(device));
    default: return nullptr;
    }
}

/// Returns the design without its objects.
Design design_of(const esi::Device& device, const DeviceOptions& o) {
    Design design;
    design.name = device.order;
    design.sii = esi::sii_contents(device);
    sii::Contents& s = design.sii;
    s.configuration[4] = o.alias;
    design.device_id = o.alias;
    if (o.serial != 0) {
        s.serial = o.serial;
    }
    for (sii::Area* area : {&s.mailboxes.receive, &s.mailboxes.send}) {
        area->size = static_cast<std::uint16_t>(std::min<std::size_t>(area->size, max_mailbox));
    }
    if (s.general.ports == std::array<std::uint8_t, 4>{}) {
        s.general.ports = {1, 1, 0, 0};
    }
    design.coe = s.has_mailbox() && (s.protocols & bit_of(MailboxType::coe)) != 0;
    design.dc = device.has_dc;
    design.sampled = sampled_pdos(device);
    if (!design.sampled.indices.empty()) {
        design.shortest_cycle_ns = 10'000;
    }
    for (const MailboxProtocol& protocol : ethercat::mailbox_protocols) {
        if (!s.has_mailbox() || (s.protocols & protocol.bit) == 0) continue;
        if (auto service = service_of(protocol.type, device, design.dictionary)) {
            design.services.push_back(std::move(service));
        }
    }
    return design;
}

/// What a master can change of the process data.
struct Adaptable {
    bool mapping = false;
    bool assignment = false;
};
Adaptable adaptable_parts(const esi::Device& device, const Design& design) {
    if (!design.coe) return {};
    const auto details = design.sii.general.coe_details;
    return {
        .mapping = (details & sii::coe_pdo_config) != 0 ||
                   is_commanded(device, coe::rx_pdo, coe::tx_pdo + 0x1ff),
        .assignment = (details & sii::coe_pdo_assign) != 0 ||
                      is_commanded(device, coe::assignment, coe::assignment + sync_manager_count)};
}

/// Adds the PDOs and their assignment to the dictionary, and the lengths of the sync managers.
void add_process_data(const esi::Device& device, const Adaptable& adaptable, Design& design) {
    Dictionary& d = *design.dictionary;
    std::set<std::uint16_t> done;
    add_pdos(device.rx, adaptable.mapping, d, done);
    add_pdos(device.tx, adaptable.mapping, d, done);
    if (design.coe) {
        add_commanded_pdos(device, d, done);
    }
    sii::Contents& s = design.sii;
    for (unsigned n = 0; n < s.sync_managers.size(); ++n) {
        const bool output = s.sync_managers[n].type == sii::SmType::outputs;
        if (!output && s.sync_managers[n].type != sii::SmType::inputs) continue;
        const auto& pdos = output ? device.rx : device.tx;
        const std::size_t bytes = add_assignment(pdos, n, adaptable.assignment, d);
        s.sync_managers[n].length = static_cast<std::uint16_t>(bytes);
        const bool changes = adaptable.mapping || adaptable.assignment;
        std::size_t& max_bytes = output ? design.max_output_bytes : design.max_input_bytes;
        max_bytes = std::max({max_bytes, bytes, max_sampled_bytes(pdos, n),
                              std::size_t{device.sync_managers[n].max_size},
                              changes ? usual_max_bytes : std::size_t{0}});
    }
    if (design.coe) {
        add_empty_assignments(s, d);
    }
}

}  // namespace

std::string not_emulated(const esi::Device& d) {
    if (!d.mailbox) return {};
    std::string protocols;
    for (const MailboxProtocol& protocol : ethercat::mailbox_protocols) {
        if (is_emulated(protocol.type) || !d.mailbox->has(protocol.type)) continue;
        protocols += (protocols.empty() ? "" : ", ") + std::string(protocol.name);
    }
    return protocols.empty() ? "" : "its mailbox protocol " + protocols;
}

Parts make_esi_device(const DeviceOptions& o) {
    esi::Device device = esi::with_modules(*o.description, *o.described, o.module_idents);
    assign_by_mode(device);
    Design design = design_of(device, o);
    Plan plan;
    add_objects(device, plan);
    add_mapped(device.rx, true, plan);
    add_mapped(device.tx, false, plan);
    add_commands(device, plan);
    // without CoE there are only the objects of the process data, whose numbers may be any
    if (design.coe) {
        if (!o.module_idents.empty()) {
            add_module_lists(o.module_idents, plan);
        }
        add_identity(design.sii, plan);
        add_sync_manager_types(design.sii, plan);
    }
    write_dictionary(plan, *design.dictionary);
    const Adaptable adaptable = adaptable_parts(device, design);
    add_process_data(device, adaptable, design);
    design.dictionary->finish();
    auto behaviour = behaviour_of(device, design);
    return {std::move(design), std::move(behaviour)};
}

}  // namespace hal::ethercat::devices
