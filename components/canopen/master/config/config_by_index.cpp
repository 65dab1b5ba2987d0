// SPDX-License-Identifier: MIT
// The configuration of a single node of which only object indices are known.
#include "config_lines.hpp"
#include "object_catalog.hpp"

namespace hal::canopen::config {

Reading read(const ByIndex& wish, const ReadFile& read_file) {
    // Other instances may have nodes on the same bus: they are not reset.
    std::string text =
        "[bus]\nsync = cycle\nreset-at-start = no\nnode-id = " + std::to_string(wish.master);
    text += "\n[node " + std::to_string(wish.slave) + "]\n";
    if (!wish.eds.empty()) {
        text += "eds = " + wish.eds + "\n";
    }
    Report report;
    if (wish.slave == wish.master) {
        report.argument(Topic::node, "slavenodeid",
                        "slavenodeid= and masternodeid= are both " + std::to_string(wish.slave),
                        "use different node IDs");
    }
    const Catalog drive("cia402", 1), lines("cia401", 1);
    const auto take = [&](const std::string& list, bool to_node) {
        unsigned number = 0;
        for (const Word& word : list_of({list, {}})) {
            const std::string item = lower(word.text);
            const std::size_t slash = std::min(item.find('/'), item.size());

            const std::size_t colon = std::min(item.find(':'), slash);
            const auto index = parse_natural(std::string_view(item).substr(0, colon));
            const auto sub =
                colon < slash
                    ? parse_natural(std::string_view(item).substr(colon + 1, slash - colon - 1))
                    : std::optional<std::uint64_t>(0);
            const auto bits = slash < item.size()
                                  ? parse_natural(std::string_view(item).substr(slash + 1))
                                  : std::nullopt;
            if (!index || !sub || *index < 0x1000 || *index > 0xffff || *sub > 255 ||
                (slash < item.size() && (!bits || (*bits != 8 && *bits != 16 && *bits != 32)))) {
                report.argument(
                    Topic::value, to_node ? "inputs" : "outputs",
                    std::string(to_node ? "inputs=" : "outputs=") + list + ": invalid object '" +
                        word.text + "'",
                    "write INDEX or INDEX:SUB, with a length other than that of its type INDEX/16");
                continue;
            }
            const auto i = static_cast<std::uint16_t>(*index);
            const auto s = static_cast<std::uint8_t>(*sub);
            const Known* known = drive.find(i, s) != nullptr ? drive.find(i, s) : lines.find(i, s);
            const bool is_natural =
                known != nullptr && known->type != Type::none && !is_signed(known->type);
            const unsigned usual =
                known != nullptr && bits_of(known->type) >= 8 ? bits_of(known->type) : 32;
            const unsigned length = bits ? static_cast<unsigned>(*bits) : usual;
            const std::string pdo = (to_node ? "rpdo" : "tpdo") + std::to_string(++number);
            const std::string label = lower(object_text(i, s));
            text += pdo + " = " + label +
                    (wish.eds.empty() || bits ? (is_natural ? " u" : " i") + std::to_string(length)
                                              : "") +
                    "\n";
            text += pdo + ".transmission = " + (to_node ? "event" : "sync") + "\n" + label +
                    ".name = " + item.substr(0, colon) +
                    (*sub != 0 ? "-" + std::to_string(*sub) : "") + "\n";
            if (i == 0x6000 || i == 0x6200) {
                text += label + ".bits = no\n";
            }
        }
    };
    if (!wish.inputs.empty()) {
        take(wish.inputs, true);
    }
    if (!wish.outputs.empty()) {
        take(wish.outputs, false);
    }
    if (report.failed()) {
        return {{}, std::move(report.all)};
    }
    return read(text, "", read_file);
}

}  // namespace hal::canopen::config
