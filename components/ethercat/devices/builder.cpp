// SPDX-License-Identifier: MIT
#include "ethercat/devices/builder.hpp"

#include <algorithm>

namespace hal::ethercat::devices {
namespace {

std::size_t bytes_of(const std::vector<sii::Pdo>& pdos) {
    std::size_t bits = 0;
    for (const auto& pdo : pdos) {
        if (pdo.sync_manager != 0xff) {
            for (const auto& e : pdo.entries) {
                bits += e.bits;
            }
        }
    }
    return (bits + 7) / 8;
}

}  // namespace

DesignBuilder::DesignBuilder(std::string name, std::uint32_t product, std::uint32_t revision) {
    design_.name = name;
    auto& s = design_.sii;
    s.configuration[0] = 0x0c05;
    s.configuration[1] = 0x8e44;
    s.vendor = vendor;
    s.product = product;
    s.revision = revision;
    s.has_general = true;
    s.general.group = "Halcyon";
    s.general.order = name;
    s.general.name = "Halcyon " + name;
    s.general.ports = {1, 1, 0, 0};
    design_.coe = false;
}

void DesignBuilder::service(std::unique_ptr<MailboxService> service) {
    design_.sii.protocols |= bit_of(service->type());
    design_.services.push_back(std::move(service));
}

void DesignBuilder::mailbox(std::size_t bytes, bool boot) {
    mailbox_bytes_ = bytes;
    auto& s = design_.sii;
    const auto size = static_cast<std::uint16_t>(bytes);
    s.mailboxes = {{0x1000, size}, {static_cast<std::uint16_t>(0x1000 + size), size}};
    if (boot) {
        s.boot = s.mailboxes;
    }
    s.protocols = bit_of(MailboxType::coe);
    s.sync_managers.push_back(
        {s.mailboxes.receive.start, size, 0x26, 0, 1, sii::SmType::mailbox_out});
    s.sync_managers.push_back({s.mailboxes.send.start, size, 0x22, 0, 1, sii::SmType::mailbox_in});
    design_.coe = true;
    s.general.coe_details = sii::coe_sdo | sii::coe_sdo_info | sii::coe_complete_access;
    auto& d = dictionary();
    namespace access = coe::access;
    d.text(0x1008, "Device name", design_.sii.general.name);
    d.text(0x1009, "Hardware version", "1.0");
    d.text(0x100a, "Software version", "1.0");
}

void DesignBuilder::pdo(bool output, std::uint16_t index, std::string name,
                        const std::vector<PdoEntry>& entries, bool assigned, unsigned max) {
    namespace access = coe::access;
    auto& pdos = output ? design_.sii.rx : design_.sii.tx;
    sii::Pdo& pdo = pdos.emplace_back();
    pdo.index = index;
    pdo.name = name;
    pdo.flags = max == 0 ? sii::pdo_fixed : std::uint16_t{0};
    // the number follows in finish()
    pdo.sync_manager = assigned ? std::uint8_t{0} : std::uint8_t{0xff};
    const std::uint16_t rights = max == 0 ? access::read : access::read | access::write_preop;
    auto& d = dictionary();
    const auto count = static_cast<std::uint8_t>(entries.size());
    std::vector<std::uint32_t> raw;
    for (const auto& e : entries) {
        std::uint8_t bits = 0;
        std::uint8_t type = 0;
        for (const auto& o : d.objects()) {
            if (o.index == e.index) {
                for (const auto& entry : o.entries) {
                    if (entry.sub == e.sub) {
                        bits = static_cast<std::uint8_t>(entry.bits);

                        type = static_cast<std::uint8_t>(entry.type);
                    }
                }
            }
        }
        if (e.index == 0) {
            bits = e.sub;  // a gap of `sub` bits
        }
        const std::uint8_t sub = e.index == 0 ? std::uint8_t{0} : e.sub;
        pdo.entries.push_back({e.index, sub, e.name, type, bits, 0});
        raw.push_back(coe::Mapping{e.index, sub, bits}.raw());
    }
    d.record(index, std::move(name), count, coe::ObjectCode::record, rights,
             coe::type::pdo_mapping);
    for (unsigned n = 1; n <= std::max<unsigned>(max, count); ++n) {
        d.sub(static_cast<std::uint8_t>(n), "Mapping " + std::to_string(n), coe::type::u32, rights,
              n <= raw.size() ? raw[n - 1] : 0);
    }
    if (max != 0) {
        design_.sii.general.coe_details |= sii::coe_pdo_assign | sii::coe_pdo_config;
    }
}

void DesignBuilder::dc(bool required, bool sync1) {
    design_.dc = true;
    design_.dc_required = required;
    auto& s = design_.sii;
    sii::DcMode mode;
    mode.sync0_factor = 1;
    mode.assign_activate = 0x0300;
    mode.name = "DC";

    mode.description = "SYNC0";
    s.dc.push_back(mode);
    if (!sync1) return;
    mode.assign_activate = 0x0700;
    mode.sync1_factor = 1;
    mode.name = "DC2";

    mode.description = "SYNC0 and SYNC1";
    s.dc.push_back(mode);
}

void DesignBuilder::assignment(bool output, std::uint16_t sm) {
    namespace access = coe::access;
    auto& pdos = output ? design_.sii.rx : design_.sii.tx;
    const bool writable = std::any_of(
        pdos.begin(), pdos.end(), [](const auto& p) { return (p.flags & sii::pdo_fixed) == 0; });
    const std::uint16_t rights = writable ? access::read | access::write_preop : access::read;
    std::vector<std::uint16_t> assigned;
    for (auto& pdo : pdos) {
        if (pdo.sync_manager != 0xff) {
            pdo.sync_manager = static_cast<std::uint8_t>(sm);
            assigned.push_back(pdo.index);
        }
    }
    dictionary().record(static_cast<std::uint16_t>(coe::assignment + sm),
                        output ? "RxPDO assignment" : "TxPDO assignment",
                        static_cast<std::uint8_t>(assigned.size()), coe::ObjectCode::array, rights,
                        coe::type::u16);
    for (std::size_t n = 1; n <= pdos.size(); ++n) {
        dictionary().sub(static_cast<std::uint8_t>(n), "PDO " + std::to_string(n), coe::type::u16,
                         rights, n <= assigned.size() ? assigned[n - 1] : 0);
    }
}

/// Adds the assignment of a sync manager without PDOs: masters write it in every device.
void DesignBuilder::empty_assignment(std::uint16_t sm) {
    namespace access = coe::access;
    dictionary().record(static_cast<std::uint16_t>(coe::assignment + sm), "PDO assignment", 0,
                        coe::ObjectCode::array, access::read | access::write_preop, coe::type::u16);
    dictionary().limit(0, 0);
}

Design DesignBuilder::finish(std::uint16_t alias, std::uint32_t serial,
                             std::size_t max_output_bytes, std::size_t max_input_bytes) {
    namespace access = coe::access;
    auto& s = design_.sii;
    auto& d = dictionary();
    s.configuration[4] = alias;
    s.general.foe = (s.protocols & bit_of(MailboxType::foe)) != 0;
    s.general.eoe = (s.protocols & bit_of(MailboxType::eoe)) != 0;
    s.serial = serial;
    design_.device_id = alias;
    const std::size_t out = bytes_of(s.rx);
    const std::size_t in = bytes_of(s.tx);
    design_.max_output_bytes = std::max(out, max_output_bytes);

    design_.max_input_bytes = std::max(in, max_input_bytes);
    std::size_t at = 0x1000 + 2 * mailbox_bytes_;
    if (!s.rx.empty()) {
        const auto sm = static_cast<std::uint16_t>(s.sync_managers.size());
        s.sync_managers.push_back({static_cast<std::uint16_t>(at), static_cast<std::uint16_t>(out),
                                   0x64, 0, 1, sii::SmType::outputs});
        assignment(true, sm);
        s.fmmus.push_back(sii::FmmuUse::outputs);
        at += (3 * design_.max_output_bytes + 127) / 128 * 128;
    } else if (mailbox_bytes_ != 0) {
        const auto sm = static_cast<std::uint16_t>(s.sync_managers.size());
        s.sync_managers.push_back(
            {static_cast<std::uint16_t>(at), 0, 0x64, 0, 0, sii::SmType::outputs});
        empty_assignment(sm);
    }
    if (!s.tx.empty()) {
        const auto sm = static_cast<std::uint16_t>(s.sync_managers.size());
        s.sync_managers.push_back({static_cast<std::uint16_t>(at), static_cast<std::uint16_t>(in),
                                   0x20, 0, 1, sii::SmType::inputs});
        assignment(false, sm);
        s.fmmus.push_back(sii::FmmuUse::inputs);
    }
    if (s.tx.empty() && mailbox_bytes_ != 0) {
        empty_assignment(static_cast<std::uint16_t>(s.sync_managers.size()));
    }
    if (mailbox_bytes_ != 0) {
        s.fmmus.push_back(sii::FmmuUse::mailbox_state);
    }
    if (design_.coe) {
        d.record(0x1018, "Identity", 4, coe::ObjectCode::record, access::read, coe::type::identity);
        d.sub(1, "Vendor ID", coe::type::u32, access::read, s.vendor);

        d.sub(2, "Product code", coe::type::u32, access::read, s.product);
        d.sub(3, "Revision", coe::type::u32, access::read, s.revision);

        d.sub(4, "Serial number", coe::type::u32, access::read, serial);
        d.record(coe::sync_manager_types, "Sync manager types",
                 static_cast<std::uint8_t>(s.sync_managers.size()), coe::ObjectCode::array);
        for (std::size_t n = 0; n < s.sync_managers.size(); ++n) {
            d.sub(static_cast<std::uint8_t>(n + 1), "Sync manager " + std::to_string(n),
                  coe::type::u8, access::read, static_cast<std::uint8_t>(s.sync_managers[n].type));
        }
        const auto& objects = d.objects();
        if (std::none_of(objects.begin(), objects.end(),
                         [](const auto& o) { return o.index == 0x1000; })) {
            d.variable(0x1000, "Device type", coe::type::u32, access::read);
        }
        d.variable(0x1001, "Error register", coe::type::u8, access::read);
    }
    d.finish();
    return std::move(design_);
}

}  // namespace hal::ethercat::devices
