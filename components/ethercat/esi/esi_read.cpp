// SPDX-License-Identifier: MIT
#include <array>
#include <cstdio>

#include "esi_xml.hpp"
#include "text/numbers.hpp"

namespace hal::ethercat::esi {

namespace {

/// Returns the use of an FMMU from its name in lower case.
sii::FmmuUse fmmu_use(std::string_view name) noexcept {
    if (name == "outputs") return sii::FmmuUse::outputs;
    if (name == "inputs") return sii::FmmuUse::inputs;
    if (name == "mboxstate") return sii::FmmuUse::mailbox_state;
    return sii::FmmuUse::unused;
}

std::string index_text(const Pdo& pdo) {
    std::array<char, 8> digits{};
    std::snprintf(digits.data(), digits.size(), "%04X", pdo.index);
    return digits.data();
}

/// As in "none", "only 0" and "only 0 to 3".
std::string count_text(std::size_t sync_managers) {
    if (sync_managers == 0) return "none";
    return sync_managers == 1 ? "only 0" : "only 0 to " + std::to_string(sync_managers - 1);
}

class Reader {
public:
    explicit Reader(std::string_view text) : context_{text} {}

    File read() {
        pugi::xml_document document;
        const auto result = document.load_buffer(context_.text.data(), context_.text.size());
        if (!result) {
            const auto at =
                std::min(static_cast<std::size_t>(std::max<std::ptrdiff_t>(result.offset, 0)),
                         context_.text.size());
            text::Span span{1, 1, static_cast<std::uint32_t>(at), 0};
            span.line += static_cast<std::uint32_t>(
                std::count(context_.text.begin(),
                           context_.text.begin() + static_cast<std::ptrdiff_t>(at), '\n'));
            context_.report.error(Topic::file, span, "invalid XML: " + lower(result.description()),
                                  "is it a device description?");
            return finish();
        }
        // a list is what the IgH master prints for several slaves
        const Xml list = document.child("EtherCATInfoList");
        const Xml root = list ? list.child("EtherCATInfo") : document.child("EtherCATInfo");
        if (!root) {
            context_.report.error(Topic::file, {1, 1, 0, 0},
                                  "the root element is '" +
                                      std::string(document.document_element().name()) +
                                      "', not EtherCATInfo",
                                  "give the ESI file of the device, an XML file from its maker");
            return finish();
        }
        for (Xml info = root; info; info = info.next_sibling("EtherCATInfo")) {
            info_of(info);
        }
        if (out_.devices.empty()) {
            context_.report.error(Topic::file, span_of(root, context_.text),
                                  "the file describes no device");
        }
        return finish();
    }

private:
    File finish() {
        out_.messages = std::move(context_.report.all);
        text::sort(out_.messages);
        return std::move(out_);
    }

    void info_of(const Xml& node) {
        vendor_ = context_.child<std::uint32_t>(node.child("Vendor"), "Id");
        const Xml descriptions = node.child("Descriptions");
        for (const Xml d : descriptions.child("Devices").children("Device")) {
            device(d);
        }
        for (const Xml m : descriptions.child("Modules").children("Module")) {
            module_of(m);
        }
    }

    /// Reads a <Device> (ETG.2000) and adds it to the description.
    void device(const Xml& node) {
        Device d;
        d.vendor = vendor_;
        d.at = span_of(node, context_.text);
        identity(node, d);
        timeouts(node.child("Info"), d.timeouts);
        for (const Xml f : node.children("Fmmu")) {
            const std::string use = lower(trimmed(f.child_value()));
            d.fmmus.push_back(fmmu_use(use));
        }
        for (const Xml s : node.children("Sm")) {
            sync_manager(s, d);
        }
        separate_mailboxes(node, d);
        process_data(node, d);
        if (const Xml box = node.child("Mailbox")) {
            mailbox_of(box, d);
        }
        if (const Xml dc = node.child("Dc")) {
            d.has_dc = true;
            for (const Xml mode : dc.children("OpMode")) {
                op_mode(mode, d);
            }
        }
        slots(node.child("Slots"), d);
        for (const Xml profile : node.children("Profile")) {
            if (d.profile == 0) {
                d.profile = context_.child<std::uint16_t>(profile, "ProfileNo");
            }
            if (d.objects.empty()) {
                d.objects = dictionary(context_, profile);
            }
        }
        if (const Xml eeprom = node.child("Eeprom")) {
            eeprom_of(eeprom, d);
        }
        out_.devices.push_back(std::move(d));
    }

    void identity(const Xml& node, Device& d) {
        const Xml type = node.child("Type");
        d.order = trimmed(type.child_value());
        d.product = context_.attribute<std::uint32_t>(type, "ProductCode");
        d.revision = context_.attribute<std::uint32_t>(type, "RevisionNo");
        d.serial = context_.attribute<std::uint32_t>(type, "SerialNo");
        d.check_revision = revision_rule(type);
        d.name = text_of(node, "Name");
        d.group = text_of(node, "GroupType");
        d.physics = node.attribute("Physics").value();
    }

    /// What is not given keeps its default.
    void timeouts(const Xml& info, Timeouts& t) {
        const Xml state = info.child("StateMachine").child("Timeout");
        t.preop = context_.child(state, "PreopTimeout", t.preop);
        t.safeop_op = context_.child(state, "SafeopOpTimeout", t.safeop_op);
        t.back_to_init = context_.child(state, "BackToInitTimeout", t.back_to_init);
        t.back_to_safeop = context_.child(state, "BackToSafeopTimeout", t.back_to_safeop);
        const Xml mailbox = info.child("Mailbox").child("Timeout");
        t.request = context_.child(mailbox, "RequestTimeout", t.request);
        t.response = context_.child(mailbox, "ResponseTimeout", t.response);
    }

    /// Reads the PDOs, and assigns those without a sync manager that may be exchanged together.
    void process_data(const Xml& node, Device& d) {
        pdos(node, "RxPdo", d.rx);
        pdos(node, "TxPdo", d.tx);
        unassign_unknown(node, d, d.rx);
        unassign_unknown(node, d, d.tx);
        correct_direction(node, d, d.tx, sii::SmType::outputs, sii::SmType::inputs);
        correct_direction(node, d, d.rx, sii::SmType::inputs, sii::SmType::outputs);
        default_sync_manager(d, d.rx, sii::SmType::outputs);
        default_sync_manager(d, d.tx, sii::SmType::inputs);
        unassign_excluded(node, d.rx);
        unassign_excluded(node, d.tx);
    }

    void slots(const Xml& node, Device& d) {
        d.slot_pdo_increment = context_.attribute<unsigned>(node, "SlotPdoIncrement", 1);
        d.slot_index_increment = context_.attribute<unsigned>(node, "SlotIndexIncrement", 0);
        if (node.attribute("DownloadModuleIdentList")) {
            d.download_modules = Context::flag(node, "DownloadModuleIdentList");
        }
        for (const Xml s : node.children("Slot")) {
            slot(s, d);
        }
    }

    std::optional<RevisionRule> revision_rule(const Xml& type) {
        const std::string_view value = trimmed(type.attribute("CheckRevisionNo").value());
        if (value.empty()) return std::nullopt;
        const auto rule = parse_revision_rule(value);
        if (!rule) {
            context_.warn(type, "unknown CheckRevisionNo '" + std::string(value.substr(0, 60)) +
                                    "'; higher revisions are accepted");
        }
        return rule;
    }

    /// Returns the type of a sync manager by its control byte (0804h), for descriptions without
    /// the name of the type.
    static sii::SmType type_by_control(std::uint8_t control, std::uint16_t start) {
        const bool is_mailbox = (control & 0x03) == 0x02;
        const bool is_output = (control & 0x0c) == 0x04;
        if (start == 0 || control == 0) return sii::SmType::unused;
        if (is_mailbox) return is_output ? sii::SmType::mailbox_out : sii::SmType::mailbox_in;
        return is_output ? sii::SmType::outputs : sii::SmType::inputs;
    }

    void sync_manager(const Xml& node, Device& d) {
        SyncManager s;
        const std::string type = lower(trimmed(node.child_value()));
        if (type == "mboxout") {
            s.type = sii::SmType::mailbox_out;
        } else if (type == "mboxin") {
            s.type = sii::SmType::mailbox_in;
        } else if (type == "outputs") {
            s.type = sii::SmType::outputs;
        } else if (type == "inputs") {
            s.type = sii::SmType::inputs;
        } else {
            s.type = sii::SmType::unused;
        }
        s.start = context_.attribute<std::uint16_t>(node, "StartAddress");

        s.default_size = context_.attribute<std::uint16_t>(node, "DefaultSize");
        s.min_size = context_.attribute<std::uint16_t>(node, "MinSize");

        s.max_size = context_.attribute<std::uint16_t>(node, "MaxSize");
        s.control = context_.attribute<std::uint8_t>(node, "ControlByte");

        s.enable = context_.attribute<std::uint8_t>(node, "Enable");
        if (type.empty()) {
            s.type = type_by_control(s.control, s.start);
        }
        d.sync_managers.push_back(s);
    }

    void pdos(const Xml& node, const char* name, std::vector<Pdo>& to,
              std::vector<bool>* depends = nullptr) {
        for (const Xml p : node.children(name)) {
            Pdo pdo;
            pdo.index = context_.child<std::uint16_t>(p, "Index");
            pdo.name = text_of(p, "Name");
            if (p.attribute("Sm")) {
                pdo.sync_manager = context_.attribute<std::uint8_t>(p, "Sm");
            }
            pdo.oversampling = oversampling(p);
            pdo.fixed = Context::flag(p, "Fixed");
            pdo.mandatory = Context::flag(p, "Mandatory");
            for (const Xml e : p.children("Exclude")) {
                pdo.exclude.push_back(
                    context_.number_of<std::uint16_t>(e, "Exclude", e.child_value()));
            }
            for (const Xml e : p.children("Entry")) {
                if (auto entry = entry_of(e)) {
                    pdo.entries.push_back(std::move(*entry));
                }
            }
            const bool known =
                pdo.index != 0 && std::any_of(to.begin(), to.end(), [&](const Pdo& other) {
                return other.index == pdo.index;
            });
            if (pdo.index == 0) {
                continue;  // a module's PDO by reference
            }
            if (known) {
                context_.warn(p, "duplicate PDO index; the first one is used");
                continue;
            }
            if (depends != nullptr) {
                depends->push_back(Context::flag(p.child("Index"), "DependOnSlot"));
            }
            to.push_back(std::move(pdo));
        }
    }
    /// Nothing for an entry of unknown length. The bits of an entry count, not its type: they are
    /// what is exchanged.
    std::optional<Entry> entry_of(const Xml& e) {
        Entry entry;
        entry.index = context_.child<std::uint16_t>(e, "Index");
        entry.sub = context_.child<std::uint8_t>(e, "SubIndex");
        entry.bits = context_.child<std::uint16_t>(e, "BitLen");
        entry.name = text_of(e, "Name");
        entry.type = trimmed(e.child_value("DataType"));
        const unsigned of_type = type_bits(entry.type);
        if (entry.bits == 0) {
            entry.bits = static_cast<std::uint16_t>(of_type);
        }
        if (entry.bits == 0) {
            context_.warn(e, "the entry has no BitLen; it is ignored");
            return std::nullopt;
        }
        if (entry.index != 0 && of_type != 0 && of_type != entry.bits) {
            context_.warn(e, "BitLen is " + std::to_string(entry.bits) + ", but " + entry.type +
                                 " has " + std::to_string(of_type) + " bits; BitLen is used");
        }
        return entry;
    }
    Oversampling oversampling(const Xml& pdo) {
        Oversampling o;
        const auto usual = context_.attribute<unsigned>(pdo, "OSFac");
        o.max = std::min(context_.attribute<unsigned>(pdo, "OSMax", usual), max_samples);
        o.min = std::clamp(context_.attribute<unsigned>(pdo, "OSMin", 1), 1U, std::max(o.max, 1U));
        o.index_increment = context_.attribute<std::uint16_t>(pdo, "OSIndexInc");
        return o;
    }
    /// A mailbox that reaches into the other one ends where that begins, if its least size allows.
    void separate_mailboxes(const Xml& node, Device& d) {
        const auto find = [&](sii::SmType type) {
            return std::find_if(d.sync_managers.begin(), d.sync_managers.end(),
                                [type](const SyncManager& s) { return s.type == type; });
        };
        auto first = find(sii::SmType::mailbox_out);
        auto second = find(sii::SmType::mailbox_in);
        if (first == d.sync_managers.end() || second == d.sync_managers.end()) return;
        if (first->start > second->start) {
            std::swap(first, second);
        }
        const unsigned distance = second->start - first->start;
        if (distance >= first->default_size || distance < std::max<unsigned>(first->min_size, 8))
            return;
        context_.warn(node, "the mailbox of " + std::to_string(first->default_size) +
                                " bytes reaches into the other one; it is read with " +
                                std::to_string(distance) + " bytes");
        first->default_size = static_cast<std::uint16_t>(distance);
    }
    /// A sync manager with the PDOs of the other direction than its name has that of its PDOs.
    void correct_direction(const Xml& node, Device& d, const std::vector<Pdo>& pdos,
                           sii::SmType named, sii::SmType used) {
        for (const Pdo& p : pdos) {
            if (!p.sync_manager || *p.sync_manager >= d.sync_managers.size()) continue;
            SyncManager& manager = d.sync_managers[*p.sync_manager];
            const auto& others = used == sii::SmType::inputs ? d.rx : d.tx;
            const bool is_shared = std::any_of(others.begin(), others.end(), [&](const Pdo& other) {
                return other.sync_manager == p.sync_manager;
            });
            if (manager.type != named || is_shared) continue;
            manager.type = used;
            context_.warn(node, "sync manager " + std::to_string(*p.sync_manager) +
                                    (used == sii::SmType::inputs
                                         ? " is named Outputs, but has TxPDOs; it is read as Inputs"
                                         : " is named Inputs, but has RxPDOs; it is read as "
                                           "Outputs"));
        }
    }

    /// A PDO of a sync manager that the device does not have is not assigned.
    void unassign_unknown(const Xml& node, const Device& d, std::vector<Pdo>& pdos) {
        for (Pdo& pdo : pdos) {
            if (!pdo.sync_manager || *pdo.sync_manager < d.sync_managers.size()) continue;
            context_.warn(node, "PDO " + index_text(pdo) + " is assigned to sync manager " +
                                    std::to_string(*pdo.sync_manager) + ", but the device has " +
                                    count_text(d.sync_managers.size()) +
                                    "; the PDO is not assigned by default");
            pdo.sync_manager.reset();
        }
    }

    /// A mandatory PDO without a sync manager has the first one of its direction.
    static void default_sync_manager(const Device& d, std::vector<Pdo>& to, sii::SmType type) {
        for (Pdo& p : to) {
            if (!p.mandatory || p.sync_manager) continue;
            for (std::size_t i = 0; i < d.sync_managers.size() && !p.sync_manager; ++i) {
                if (d.sync_managers[i].type == type) {
                    p.sync_manager = static_cast<std::uint8_t>(i);
                }
            }
        }
    }

    /// Of PDOs that are assigned by default and exclude each other, only one is assigned: the
    /// mandatory one, or else the first.
    void unassign_excluded(const Xml& node, std::vector<Pdo>& pdos) {
        const auto names = [](const Pdo& pdo, std::uint16_t other) {
            return std::find(pdo.exclude.begin(), pdo.exclude.end(), other) != pdo.exclude.end();
        };
        for (Pdo& pdo : pdos) {
            if (!pdo.sync_manager || pdo.mandatory) continue;
            const auto kept = std::find_if(pdos.begin(), pdos.end(), [&](const Pdo& other) {
                return (other.mandatory || &other < &pdo) && other.sync_manager &&
                       (names(other, pdo.index) || names(pdo, other.index));
            });
            if (kept == pdos.end()) continue;
            pdo.sync_manager.reset();
            context_.warn(node, "PDOs " + index_text(*kept) + " and " + index_text(pdo) +
                                    " exclude each other, but both are assigned by default; " +
                                    index_text(pdo) + " is left out");
        }
    }

    void mailbox_of(const Xml& node, Device& d) {
        Mailbox m;
        m.repeat = Context::flag(node, "DataLinkLayer");
        for (const MailboxProtocol& protocol : mailbox_protocols) {
            if (node.child(protocol.name)) {
                m.protocols |= protocol.bit;
            }
        }
        if (const Xml coe = node.child("CoE")) {
            m.sdo_info = Context::flag(coe, "SdoInfo");

            m.pdo_assign = Context::flag(coe, "PdoAssign");

            m.pdo_config = Context::flag(coe, "PdoConfig");
            m.pdo_upload = Context::flag(coe, "PdoUpload");

            m.complete_access = Context::flag(coe, "CompleteAccess");
            m.segmented_sdo = Context::flag(coe, "SegmentedSdo", true);
            init_commands(coe, InitCmd::Protocol::coe, d.init_commands);
        }
        if (const Xml soe = node.child("SoE")) {
            m.soe_channels = context_.attribute<std::uint8_t>(soe, "ChannelCount", 1);
            init_commands(soe, InitCmd::Protocol::soe, d.init_commands);
        }
        d.mailbox = m;
    }
    void init_commands(const Xml& node, InitCmd::Protocol protocol, std::vector<InitCmd>& to) {
        for (const Xml c : node.children("InitCmd")) {
            InitCmd cmd;
            cmd.protocol = protocol;
            for (const Xml t : c.children("Transition")) {
                cmd.transitions.emplace_back(trimmed(t.child_value()));
            }
            const bool soe = protocol == InitCmd::Protocol::soe;
            cmd.index = context_.child<std::uint16_t>(c, soe ? "IDN" : "Index");
            cmd.sub = soe ? context_.attribute<std::uint8_t>(c, "Chn")
                          : context_.child<std::uint8_t>(c, "SubIndex");
            cmd.complete = Context::flag(c, "CompleteAccess");
            cmd.data = context_.bytes(c.child("Data"));
            cmd.comment = text_of(c, "Comment");
            to.push_back(std::move(cmd));
        }
    }

    void op_mode(const Xml& node, Device& d) {
        OpMode m;
        m.name = text_of(node, "Name");
        m.description = text_of(node, "Desc");
        m.assign_activate = context_.child<std::uint16_t>(node, "AssignActivate");
        m.sync0_cycle_ns = context_.child<std::int64_t>(node, "CycleTimeSync0");

        m.sync1_cycle_ns = context_.child<std::int64_t>(node, "CycleTimeSync1");
        m.sync0_factor = context_.attribute<int>(node.child("CycleTimeSync0"), "Factor", 1);
        m.sync1_factor = context_.attribute<int>(node.child("CycleTimeSync1"), "Factor", 0);
        m.sync0_shift_ns = context_.child<std::int64_t>(node, "ShiftTimeSync0");

        m.sync1_shift_ns = context_.child<std::int64_t>(node, "ShiftTimeSync1");
        for (const Xml manager : node.children("Sm")) {
            for (const Xml pdo : manager.children("Pdo")) {
                m.assigned.push_back(
                    {context_.attribute<std::uint8_t>(manager, "No"),
                     context_.number_of<std::uint16_t>(pdo, "Pdo", pdo.child_value()),
                     std::min(context_.attribute<unsigned>(pdo, "OSFac"), max_samples)});
            }
        }
        d.op_modes.push_back(std::move(m));
    }

    void slot(const Xml& node, Device& d) {
        Slot s;
        s.name = text_of(node, "Name");
        for (const Xml m : node.children("ModuleIdent")) {
            const auto ident = context_.number_of<std::uint32_t>(m, "ModuleIdent", m.child_value());
            s.modules.push_back(ident);
            if (Context::flag(m, "Default")) {
                s.default_module = ident;
            }
        }
        const unsigned count =
            std::clamp(context_.attribute<unsigned>(node, "MaxInstances", 1), 1U, 255U);
        for (unsigned i = 0; i < count && d.slots.size() < 255; ++i) {
            d.slots.push_back(s);
        }
    }

    void module_of(const Xml& node) {
        Module m;
        m.ident = context_.attribute<std::uint32_t>(node.child("Type"), "ModuleIdent");
        m.type = trimmed(node.child_value("Type"));
        m.name = text_of(node, "Name");
        pdos(node, "RxPdo", m.rx, &m.rx_depends);
        pdos(node, "TxPdo", m.tx, &m.tx_depends);
        init_commands(node.child("Mailbox").child("CoE"), InitCmd::Protocol::coe, m.init_commands);
        m.objects = dictionary(context_, node.child("Profile"));
        out_.modules.push_back(std::move(m));
    }

    void eeprom_of(const Xml& node, Device& d) {
        if (node.child("Data")) {
            d.eeprom = context_.bytes(node.child("Data"));
        }
        d.eeprom_bytes =
            std::min<std::size_t>(context_.child<std::size_t>(node, "ByteSize"), 128 * 1024);
        d.config_data = context_.bytes(node.child("ConfigData"));

        d.bootstrap = context_.bytes(node.child("BootStrap"));
        for (const Xml c : node.children("Category")) {
            sii::OtherCategory category{context_.child<std::uint16_t>(c, "CatNo"), {}};
            const auto value = [&](const char* name, unsigned bytes) {
                const auto n = context_.child<std::uint64_t>(c, name);
                for (unsigned i = 0; i < bytes; ++i) {
                    category.data.push_back(static_cast<std::uint8_t>(n >> (8 * i)));
                }
            };
            if (c.child("Data")) {
                category.data = context_.bytes(c.child("Data"));
            } else if (c.child("DataUINT")) {
                value("DataUINT", 2);
            } else if (c.child("DataUDINT")) {
                value("DataUDINT", 4);
            } else {
                for (const char letter : std::string_view(c.child_value("DataString"))) {
                    category.data.push_back(static_cast<std::uint8_t>(letter));
                }
            }
            if (category.data.size() <= 0xffff && category.type > 60 && category.type != 0xffff) {
                d.categories.push_back(std::move(category));
            }
        }
    }

    Context context_;
    std::uint32_t vendor_ = 0;  ///< of the EtherCATInfo that is being read
    File out_;
};

}  // namespace

File read(std::string_view xml) { return Reader(xml).read(); }

std::optional<std::int64_t> number(std::string_view text) {
    text = trimmed(text);
    const bool negative = text.starts_with('-');
    if (negative || text.starts_with('+')) {
        text.remove_prefix(1);
    }
    std::string digits(text);
    if (text.starts_with("#x") || text.starts_with("#X")) {
        digits = "0x" + std::string(text.substr(2));
    } else if (text.starts_with("0X")) {
        digits[1] = 'x';
    }
    const auto value = parse_natural(digits);
    if (!value) {
        return {};
    }
    return static_cast<std::int64_t>(negative ? 0 - *value : *value);
}

/// Returns the value of a digit in lower case; -1 for other characters.
static int hex_digit(char c) noexcept {
    if (c >= '0' && c <= '9') return c - '0';
    if (c >= 'a' && c <= 'f') return c - 'a' + 10;
    return -1;
}

std::optional<std::vector<std::uint8_t>> hex_bytes(std::string_view text) {
    std::vector<std::uint8_t> out;
    int high = -1;
    for (const char c : text) {
        const int digit = hex_digit(lower(c));
        if (is_blank(c) || c == '\r' || c == '\n') continue;
        if (digit < 0) {
            return {};
        }
        if (high < 0) {
            high = digit;
        } else {
            out.push_back(static_cast<std::uint8_t>(high << 4 | digit));
            high = -1;
        }
    }
    if (high >= 0) {
        return {};
    }
    return out;
}

}  // namespace hal::ethercat::esi
