// SPDX-License-Identifier: MIT
// What is found in a device description, modules in their slots, and the SII of a device.
#include <algorithm>
#include <cstdio>

#include "ethercat/esi/esi.hpp"
#include "ethercat/wire/byte_order.hpp"
#include "text/characters.hpp"
#include "text/find_row.hpp"
#include "text/numbers.hpp"

namespace hal::ethercat::esi {

unsigned Pdo::bits() const {
    unsigned sum = 0;
    for (const Entry& e : entries) {
        sum += e.bits;
    }
    return sum;
}

unsigned OpMode::samples() const noexcept {
    unsigned max = 0;
    for (const Assigned& one : assigned) {
        max = std::max(max, one.samples);
    }
    return max;
}

const Value* Object::find(std::uint8_t sub) const { return find_row(values, sub, &Value::sub); }

const Object* Device::find(std::uint16_t index) const {
    const auto found =
        std::lower_bound(objects.begin(), objects.end(), index,
                         [](const Object& o, std::uint16_t i) { return o.index < i; });
    return found != objects.end() && found->index == index ? &*found : nullptr;
}

const Value* Device::find(std::uint16_t index, std::uint8_t sub) const {
    const Object* object = find(index);
    return object == nullptr ? nullptr : object->find(sub);
}

const Pdo* Device::find_pdo(std::uint16_t index) const {
    for (const auto* pdos : {&rx, &tx}) {
        for (const Pdo& p : *pdos) {
            if (p.index == index) return &p;
        }
    }
    return nullptr;
}

namespace {

/// Adds a PDO of a module. It replaces the PDO of the device with its number, which applies to an
/// empty slot; a number that two modules use counts once.
void add_module_pdo(Pdo&& pdo, const std::vector<Pdo>& of_device, std::vector<Pdo>& to) {
    const auto has_index = [&](const Pdo& other) { return other.index == pdo.index; };
    const auto at = std::find_if(to.begin(), to.end(), has_index);
    if (at == to.end()) {
        to.push_back(std::move(pdo));
        return;
    }
    if (std::none_of(of_device.begin(), of_device.end(), has_index)) return;
    if (!pdo.sync_manager) {
        pdo.sync_manager = at->sync_manager;
    }
    *at = std::move(pdo);
}

}  // namespace

Device with_modules(const File& file, const Device& device,
                    const std::vector<std::uint32_t>& idents) {
    Device out = device;
    for (std::size_t slot = 0; slot < idents.size(); ++slot) {
        const auto module = std::find_if(file.modules.begin(), file.modules.end(),
                                         [&](const Module& m) { return m.ident == idents[slot]; });
        if (idents[slot] == 0 || module == file.modules.end()) continue;
        const auto add = [&](const std::vector<Pdo>& from, const std::vector<bool>& depends,
                             const std::vector<Pdo>& of_device, std::vector<Pdo>& to) {
            for (std::size_t i = 0; i < from.size(); ++i) {
                Pdo p = from[i];
                if (depends[i]) {
                    p.index =
                        static_cast<std::uint16_t>(p.index + slot * device.slot_pdo_increment);
                }
                for (Entry& e : p.entries) {
                    if (depends[i] && e.index != 0) {
                        e.index = static_cast<std::uint16_t>(e.index +
                                                             slot * device.slot_index_increment);
                    }
                }
                add_module_pdo(std::move(p), of_device, to);
            }
        };
        add(module->rx, module->rx_depends, device.rx, out.rx);
        add(module->tx, module->tx_depends, device.tx, out.tx);
        out.init_commands.insert(out.init_commands.end(), module->init_commands.begin(),
                                 module->init_commands.end());
        for (Object o : module->objects) {
            o.index = static_cast<std::uint16_t>(o.index + slot * device.slot_index_increment);
            if (out.find(o.index) != nullptr) continue;
            out.objects.insert(std::upper_bound(out.objects.begin(), out.objects.end(), o,
                                                [](const Object& a, const Object& b) {
                return a.index < b.index;
            }),
                               o);
        }
    }
    return out;
}

std::vector<std::uint32_t> default_modules(const Device& device) {
    std::vector<std::uint32_t> idents;
    for (const Slot& slot : device.slots) {
        idents.push_back(slot.default_module);
    }
    return idents;
}

std::optional<std::uint32_t> find_module(const File& file, std::string_view text) {
    if (text == "-") return 0;
    const auto number = parse_natural(text);
    for (const Module& m : file.modules) {
        const bool has_number = number && *number == m.ident;
        if (has_number || same_word(m.type, text) || same_word(m.name, text)) return m.ident;
    }
    return std::nullopt;
}

std::string longer_entry(const Device& device, const Pdo& pdo) {
    for (const Entry& e : pdo.entries) {
        const Value* value = e.index == 0 ? nullptr : device.find(e.index, e.sub);
        if (value == nullptr || value->bits == 0 || e.bits <= value->bits) continue;
        char text[96];
        std::snprintf(text, sizeof text, "PDO %04X maps %u bits of object %04X:%u, which has %u",
                      pdo.index, e.bits, e.index, e.sub, value->bits);
        return text;
    }
    return {};
}

namespace {

void add_pdos(const std::vector<Pdo>& from, std::vector<sii::Pdo>& to) {
    for (const Pdo& p : from) {
        sii::Pdo out;
        out.index = p.index;
        out.name = p.name;
        out.sync_manager = p.sync_manager.value_or(0xff);
        out.flags = static_cast<std::uint16_t>((p.mandatory ? sii::pdo_mandatory : 0) |
                                               (p.fixed ? sii::pdo_fixed : 0));
        for (const Entry& e : p.entries) {
            unsigned bits = e.bits;  // one entry holds 255 bits at most: the rest follows as gaps
            sii::Entry first{e.index, e.sub,
                             e.name,  e.index == 0 ? std::uint8_t{0} : sii::type_number(e.type),
                             0,       0};
            do {
                first.bits = static_cast<std::uint8_t>(bits > 255 ? 248 : bits);
                bits -= first.bits;
                out.entries.push_back(first);
                first = {};
            } while (bits != 0);
        }
        to.push_back(std::move(out));
    }
}

}  // namespace

sii::Contents sii_contents(const Device& d) {
    sii::Contents out;
    for (std::size_t i = 0; i + 1 < d.config_data.size() && i < 14; i += 2) {
        out.configuration[i / 2] = get<std::uint16_t>(d.config_data.data() + i);
    }
    out.vendor = d.vendor;
    out.product = d.product;
    out.revision = d.revision;

    out.serial = d.serial;
    if (d.bootstrap.size() >= 8) {
        const std::uint8_t* b = d.bootstrap.data();
        out.boot = {{get<std::uint16_t>(b), get<std::uint16_t>(b + 2)},
                    {get<std::uint16_t>(b + 4), get<std::uint16_t>(b + 6)}};
    }
    out.eeprom_bytes = d.eeprom_bytes;
    out.fmmus = d.fmmus;
    for (const SyncManager& s : d.sync_managers) {
        out.sync_managers.push_back({s.start, s.default_size, s.control, 0, s.enable, s.type});
        if (s.type == sii::SmType::mailbox_out) {
            out.mailboxes.receive = {s.start, s.default_size};
        }
        if (s.type == sii::SmType::mailbox_in) {
            out.mailboxes.send = {s.start, s.default_size};
        }
    }
    add_pdos(d.tx, out.tx);
    add_pdos(d.rx, out.rx);
    for (const OpMode& m : d.op_modes) {
        out.dc.push_back(
            {static_cast<std::uint32_t>(m.sync0_cycle_ns),
             static_cast<std::int32_t>(m.sync0_shift_ns),
             static_cast<std::int32_t>(m.sync1_shift_ns), static_cast<std::int16_t>(m.sync1_factor),
             static_cast<std::int16_t>(m.sync0_factor), m.assign_activate, m.name, m.description});
    }
    out.has_general = true;
    sii::General& g = out.general;
    g.group = d.group;
    g.order = d.order;
    g.name = d.name;
    if (d.mailbox) {
        const Mailbox& m = *d.mailbox;
        const auto bit = [](bool set, unsigned value) { return set ? value : 0U; };
        out.protocols = m.protocols;
        g.coe_details = static_cast<std::uint8_t>(
            bit(m.has(MailboxType::coe), sii::coe_sdo) | bit(m.sdo_info, sii::coe_sdo_info) |
            bit(m.pdo_assign, sii::coe_pdo_assign) | bit(m.pdo_config, sii::coe_pdo_config) |
            bit(m.pdo_upload, sii::coe_upload_at_start) |
            bit(m.complete_access, sii::coe_complete_access));
        g.foe = m.has(MailboxType::foe);
        g.eoe = m.has(MailboxType::eoe);
        g.soe_channels = m.soe_channels;
    }
    if (d.profile == 402) {
        g.ds402_channels = 1;
    }
    for (std::size_t i = 0; i < 4 && i < d.physics.size(); ++i) {
        if (d.physics[i] == 'Y') {
            g.ports[i] = 1;
        } else if (d.physics[i] == 'K') {
            g.ports[i] = 3;
        } else {
            g.ports[i] = 0;
        }
    }
    out.others = d.categories;
    return out;
}

std::vector<std::uint8_t> sii_image(const Device& device) {
    return device.eeprom.size() >= 128 ? device.eeprom : sii::build(sii_contents(device));
}

}  // namespace hal::ethercat::esi
