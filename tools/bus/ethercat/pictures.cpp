// SPDX-License-Identifier: MIT
// `hal ethercat xml` and `graph`: a device description from the EEPROM of a slave, and the topology
// as a picture.
#include <algorithm>
#include <iterator>

#include "bus/ethercat/wire.hpp"
#include "bus/ethercat/words.hpp"
#include "cli/output.hpp"

namespace hal::tools {

namespace {

std::string escaped(const std::string& text) {
    std::string out;
    for (const char c : text) {
        if (c == '&') {
            out += "&amp;";
        } else if (c == '<') {
            out += "&lt;";
        } else if (c == '>') {
            out += "&gt;";
        } else if (c == '"') {
            out += "&quot;";
        } else if (static_cast<unsigned char>(c) >= 0x20 && c != 0x7f) {
            out += c;
        }
    }
    return out;
}

std::string pdo_xml(const ethercat::sii::Pdo& pdo, const char* element) {
    std::string text = fmt::format("        <{}", element);
    if (pdo.sync_manager != 0xff) {
        text += fmt::format(" Sm=\"{}\"", pdo.sync_manager);
    }
    if ((pdo.flags & ethercat::sii::pdo_fixed) != 0) {
        text += " Fixed=\"1\"";
    }
    text += fmt::format(">\n          <Index>#x{:04X}</Index>\n          <Name>{}</Name>\n",
                        pdo.index, escaped(pdo.name));
    for (const auto& e : pdo.entries) {
        text += fmt::format("          <Entry><Index>#x{:04X}</Index>", e.index);
        if (e.index != 0) {
            text += fmt::format("<SubIndex>{}</SubIndex>", e.sub);
        }
        text += fmt::format("<BitLen>{}</BitLen>", e.bits);
        if (e.index != 0) {
            text += fmt::format("<Name>{}</Name><DataType>{}</DataType>", escaped(e.name),
                                ethercat::sii::type_name(e.type));
        }
        text += "</Entry>\n";
    }
    return text + fmt::format("        </{}>\n", element);
}

/// The attributes of CoE in an ESI, from the CoE details of the SII.
std::string coe_attributes(std::uint8_t details) {
    const auto flag = [&](std::uint8_t bit) { return (details & bit) != 0 ? 1 : 0; };
    return fmt::format(" SdoInfo=\"{}\" PdoAssign=\"{}\" PdoConfig=\"{}\" CompleteAccess=\"{}\"",
                       flag(ethercat::sii::coe_sdo_info), flag(ethercat::sii::coe_pdo_assign),
                       flag(ethercat::sii::coe_pdo_config),
                       flag(ethercat::sii::coe_complete_access));
}

std::string device_xml(const ethercat::sii::Contents& c) {
    constexpr const char* sm_words[] = {"", "MBoxOut", "MBoxIn", "Outputs", "Inputs"};
    std::string text = fmt::format(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<EtherCATInfo>\n  "
        "<Vendor><Id>#x{:X}</Id></Vendor>\n"
        "  <Descriptions>\n    <Devices>\n      <Device>\n",
        c.vendor);
    text += fmt::format(
        "        <Type ProductCode=\"#x{:08X}\" RevisionNo=\"#x{:08X}\">{}</Type>\n        "
        "<Name>{}</Name>\n",
        c.product, c.revision, escaped(c.general.order.empty() ? c.general.name : c.general.order),
        escaped(c.general.name));
    for (const auto& sm : c.sync_managers) {
        const auto type = static_cast<std::size_t>(sm.type);
        text += fmt::format(
            "        <Sm StartAddress=\"#x{:04X}\" ControlByte=\"#x{:02X}\" Enable=\"{}\" "
            "DefaultSize=\"{}\">{}</Sm>\n",
            sm.start, sm.control, sm.enable & 1, sm.length,
            type < std::size(sm_words) ? sm_words[type] : "");
    }
    for (const auto& pdo : c.rx) {
        text += pdo_xml(pdo, "RxPdo");
    }
    for (const auto& pdo : c.tx) {
        text += pdo_xml(pdo, "TxPdo");
    }
    if (c.has_mailbox()) {
        text += "        <Mailbox>\n";
        for (const ethercat::MailboxProtocol& protocol : ethercat::mailbox_protocols) {
            if ((c.protocols & protocol.bit) == 0) continue;
            std::string attributes;
            if (protocol.type == ethercat::MailboxType::coe) {
                attributes = coe_attributes(c.general.coe_details);
            }
            text += fmt::format("          <{}{}/>\n", protocol.name, attributes);
        }
        text += "        </Mailbox>\n";
    }
    if (!c.dc.empty()) {
        text += "        <Dc>\n";
    }
    for (const auto& mode : c.dc) {
        text += fmt::format(
            "          <OpMode><Name>{}</Name><AssignActivate>#x{:X}</AssignActivate></OpMode>\n",
            escaped(mode.name.empty() ? "DC" : mode.name), mode.assign_activate);
    }
    if (!c.dc.empty()) {
        text += "        </Dc>\n";
    }
    return text + "      </Device>\n    </Devices>\n  </Descriptions>\n</EtherCATInfo>\n";
}

std::string topology_svg(EthercatWire& wire) {
    constexpr std::size_t row = 56;
    constexpr std::size_t step = 44;
    constexpr std::size_t box_width = 260;
    constexpr std::size_t box_height = 40;
    constexpr std::size_t margin = 16;
    std::vector<std::size_t> depth(wire.size());
    std::size_t deepest = 0;
    std::string text;
    for (std::size_t n = 0; n < wire.size(); ++n) {
        const auto& s = wire.slave(n);
        const auto parent = static_cast<std::size_t>(s.parent < 0 ? 0 : s.parent);
        if (s.parent >= 0) {
            depth[n] = depth[parent] + 1;
        }
        deepest = std::max(deepest, depth[n]);
        const std::size_t x = margin + depth[n] * step;
        const std::size_t y = margin + n * row;
        if (s.parent >= 0) {
            const std::size_t from = margin + depth[parent] * step + step / 2;

            const std::size_t top = margin + parent * row + box_height;
            text += fmt::format("<path d=\"M{} {}V{}H{}\" fill=\"none\" stroke=\"#333\"/>\n", from,
                                top, y + box_height / 2, x);
            text += fmt::format("<text x=\"{}\" y=\"{}\">{}</text>\n", from + 3,
                                y + box_height / 2 - 3, s.parent_port);
        }
        const char* fill = s.state == ethercat::State::op ? "#bfe5bf" : "#e6e6e6";
        if (s.al_failed) {
            fill = "#f4b6b6";
        }
        text += fmt::format(
            "<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" fill=\"{}\" stroke=\"#333\"/>\n", x,
            y, box_width, box_height, fill);
        text += fmt::format("<text x=\"{}\" y=\"{}\">{}  {}</text>\n", x + 8, y + 17, n,
                            escaped(wire.name(n)));
        text += fmt::format("<text x=\"{}\" y=\"{}\">{}{}{}</text>\n", x + 8, y + 33,
                            ethercat::to_string(s.state), s.al_failed ? " + error" : "",
                            s.has_dc() ? fmt::format(", delay {} ns", s.delay_ns) : "");
    }
    return fmt::format(
               "<svg xmlns=\"http://www.w3.org/2000/svg\" "
               "width=\"{}\" height=\"{}\" font-family=\"sans-serif\" font-size=\"12\">\n",
               2 * margin + deepest * step + box_width, margin + wire.size() * row) +
           text + "</svg>\n";
}

}  // namespace

int run_ethercat_xml(const EthercatPositionOptions& options) {
    EthercatWire wire;
    if (!wire.open(options) || !wire.without_arguments(options)) return 1;
    const auto* s = wire.chosen(options);
    if (s == nullptr) return 1;
    const std::string text = device_xml(wire.contents(s->position));
    if (!options.json) return print(text) ? 0 : 1;
    return print(fmt::format("{{\"position\":{},\"xml\":{}}}\n", s->position, json_string(text)))
               ? 0
               : 1;
}

int run_ethercat_graph(const EthercatOptions& options) {
    EthercatWire wire;
    if (!wire.open(options) || !wire.without_arguments(options)) return 1;
    wire.identify();
    const std::string text = topology_svg(wire);
    if (!options.json) return print(text) ? 0 : 1;
    return print(fmt::format("{{\"svg\":{}}}\n", json_string(text))) ? 0 : 1;
}

}  // namespace hal::tools
