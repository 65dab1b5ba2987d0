// SPDX-License-Identifier: MIT
// The configuration of a single node of which only object indices are known.
#include <algorithm>

#include "config_lines.hpp"
#include "object_catalog.hpp"

namespace hal::canopen::config {

namespace {

/// An item of `inputs=` or `outputs=`: INDEX[:SUB][/BITS], in decimal or with 0x.
struct Item {
    std::uint16_t index = 0;
    std::uint8_t sub = 0;
    std::optional<unsigned> bits{};
    std::string index_text;  ///< as written, for the name of the pin
};

std::optional<Item> parse_item(const std::string& text) {
    const std::size_t slash = std::min(text.find('/'), text.size());
    const std::size_t colon = std::min(text.find(':'), slash);
    Item out;
    out.index_text = text.substr(0, colon);
    const auto index = parse_natural(out.index_text);
    if (!index || *index < 0x1000 || *index > 0xffff) return std::nullopt;
    out.index = static_cast<std::uint16_t>(*index);
    if (colon < slash) {
        const auto sub = parse_natural(text.substr(colon + 1, slash - colon - 1));
        if (!sub || *sub > 255) return std::nullopt;
        out.sub = static_cast<std::uint8_t>(*sub);
    }
    if (slash < text.size()) {
        const auto bits = parse_natural(text.substr(slash + 1));
        if (!bits || (*bits != 8 && *bits != 16 && *bits != 32)) return std::nullopt;
        out.bits = static_cast<unsigned>(*bits);
    }
    return out;
}

/// Writes the configuration that the load arguments mean.
class Writer {
public:
    Writer(const ByIndex& arguments, Report& report)
        : has_eds_(!arguments.eds.empty()), report_(report) {}

    void add(const std::string& list, bool to_node) {
        unsigned number = 0;
        for (const Word& word : list_of({list, {}})) {
            ++number;
            const auto item = parse_item(lower(word.text));
            if (item) {
                add(*item, (to_node ? "rpdo" : "tpdo") + std::to_string(number), to_node);
                continue;
            }
            const std::string argument = to_node ? "inputs" : "outputs";
            report_.argument(
                Topic::value, argument,
                argument + "=" + list + ": invalid object '" + word.text + "'",
                "write INDEX or INDEX:SUB, with a length other than that of its type INDEX/16");
        }
    }
    const std::string& text() const { return text_; }

private:
    void add(const Item& item, const std::string& pdo, bool to_node) {
        const std::string label = lower(object_text(item.index, item.sub));
        text_ += pdo + " = " + label + type_of(item) + "\n" + pdo +
                 ".transmission = " + (to_node ? "event" : "sync") + "\n" + label +
                 ".name = " + item.index_text +
                 (item.sub != 0 ? "-" + std::to_string(item.sub) : "") + "\n";
        if (item.index == 0x6000 || item.index == 0x6200) {
            text_ += label + ".bits = no\n";
        }
    }

    /// Returns " u16" where no description has the type, or the length is given.
    std::string type_of(const Item& item) const {
        if (has_eds_ && !item.bits) return {};
        const Known* known = drive_.find(item.index, item.sub);
        if (known == nullptr) {
            known = lines_.find(item.index, item.sub);
        }
        const bool is_natural =
            known != nullptr && known->type != Type::none && !is_signed(known->type);
        const unsigned usual =
            known != nullptr && bits_of(known->type) >= 8 ? bits_of(known->type) : 32;
        return (is_natural ? " u" : " s") + std::to_string(item.bits.value_or(usual));
    }

    bool has_eds_;
    Report& report_;
    Catalog drive_{"cia402", 1};
    Catalog lines_{"cia401", 1};
    std::string text_;
};

}  // namespace

ReadResult read(const ByIndex& request, const ReadFile& read_file) {
    // Other instances may have nodes on the same bus: they are not reset.
    std::string text =
        "[bus]\nsync = cycle\nreset-at-start = no\nnode-id = " + std::to_string(request.master);
    text += "\n[node " + std::to_string(request.slave) + "]\n";
    if (!request.eds.empty()) {
        text += "eds = " + request.eds + "\n";
    }
    Report report;
    if (request.slave == request.master) {
        report.argument(Topic::node, "slavenodeid",
                        "slavenodeid= and masternodeid= are both " + std::to_string(request.slave),
                        "use different node IDs");
    }
    Writer writer(request, report);
    if (!request.inputs.empty()) {
        writer.add(request.inputs, true);
    }
    if (!request.outputs.empty()) {
        writer.add(request.outputs, false);
    }
    if (report.failed()) return {{}, std::move(report.all)};
    return read(text + writer.text(), "", read_file);
}

}  // namespace hal::canopen::config
