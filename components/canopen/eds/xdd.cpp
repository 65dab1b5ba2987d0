// SPDX-License-Identifier: MIT
#include "xdd.hpp"

#include <algorithm>
#include <map>

#include "eds_reader.hpp"

#if HALCYON_XDD
#include <pugixml.hpp>
#endif

namespace hal::canopen::eds {

#if HALCYON_XDD

namespace {

using Node = pugi::xml_node;

/// The name without its namespace.
std::string_view local(const Node& node) {
    const std::string_view name = node.name();
    const std::size_t colon = name.rfind(':');
    return colon == std::string_view::npos ? name : name.substr(colon + 1);
}

Node descendant(const Node& from, std::string_view name) {
    return from.find_node([&](const Node& node) { return local(node) == name; });
}

std::string attribute(const Node& node, const char* name) {
    return std::string(trimmed(node.attribute(name).value()));
}

/// A parameter of ApplicationProcess that an object refers to.
struct Parameter {
    Node node;
    std::string name, default_value, actual_value, low, high, denotation;
    std::uint16_t data_type = 0;
    std::string access;
};

struct IecType {
    std::string_view name;
    std::uint16_t code;
};
constexpr IecType iec_types[] = {
    {"BOOL", 0x01},  {"SINT", 0x02}, {"INT", 0x03},    {"DINT", 0x04},      {"USINT", 0x05},
    {"BYTE", 0x05},  {"CHAR", 0x05}, {"UINT", 0x06},   {"WORD", 0x06},      {"UDINT", 0x07},
    {"DWORD", 0x07}, {"REAL", 0x08}, {"STRING", 0x09}, {"BITSTRING", 0x0A}, {"WSTRING", 0x0B},
    {"LREAL", 0x11}, {"LINT", 0x15}, {"ULINT", 0x1B},  {"LWORD", 0x1B}};

class Xdd {
public:
    Xdd(const Node& root, std::string_view text, std::vector<Message>& messages)
        : root_(root), text_(text), messages_(messages) {}

    DeviceDescription read() {
        parameters();
        identity();
        for (Node list = descendant(root_, "CANopenObjectList"), one = list.first_child(); one;
             one = one.next_sibling()) {
            if (local(one) == "CANopenObject") {
                object(one);
            }
        }
        std::sort(out_.objects.begin(), out_.objects.end(),
                  [](const Object& a, const Object& b) { return a.index < b.index; });
        network();
        return std::move(out_);
    }

private:
    Span place(const Node& node) const {
        const auto debug = node.offset_debug();
        const std::size_t at =
            debug < 0 ? 0 : std::min(static_cast<std::size_t>(debug), text_.size());
        const std::size_t start = text_.substr(0, at).rfind('\n') + 1;  // npos + 1 is 0
        Span out{1, 1, static_cast<std::uint32_t>(at),
                 static_cast<std::uint32_t>(std::string_view(node.name()).size())};
        out.line += static_cast<std::uint32_t>(
            std::count(text_.begin(), text_.begin() + static_cast<std::ptrdiff_t>(at), '\n'));
        for (std::size_t i = start; i < at; ++i) {
            out.column += (text_[i] & 0xC0) != 0x80;
        }
        return out;
    }
    void report(Severity severity, Topic topic, const Node& node, std::string sentence,
                std::string help = "") {
        messages_.push_back({severity, topic, place(node), std::move(sentence), std::move(help)});
    }

    std::optional<std::uint64_t> number(const Node& node, const char* name, std::uint64_t max,
                                        bool hexadecimal = false) {
        const std::string text = attribute(node, name);
        if (text.empty()) {
            return {};
        }
        const auto value = parse_number(
            hexadecimal && text.find_first_of("xX") == std::string::npos ? "0x" + text : text);
        const bool negative = value && value->negative && value->magnitude != 0;
        if (!value || value->node_id || negative || value->magnitude > max) {
            report(Severity::warning, Topic::number, node,
                   "'" + std::string(name) + "' is not a number of 0.." + std::to_string(max) +
                       ": '" + text.substr(0, 60) + "'");
            return {};
        }
        report_leading_zero(node, name, *value);
        return value->magnitude;
    }
    void report_leading_zero(const Node& node, const char* name, const Number& value) {
        const std::string it = "'" + std::string(name) + "'";
        const std::string magnitude = std::to_string(value.magnitude);
        if (value.spelling == Spelling::octal) {
            report(Severity::warning, Topic::value, node,
                   it + " begins with 0 and is read as octal: " + magnitude,
                   "write " + hex(value.magnitude, 1) + ", or remove the 0");
        }
        if (value.spelling == Spelling::decimal_with_zero) {
            report(Severity::warning, Topic::value, node,
                   it + " begins with 0 but is not octal; read as decimal " + magnitude,
                   "remove the 0");
        }
    }
    bool flag(const Node& node, const char* name) {
        const std::string text = lower(attribute(node, name));
        return text == "true" || text == "1";
    }

    void parameters() {
        const Node process = descendant(root_, "ApplicationProcess");
        if (!process) return;
        for (Node list = descendant(process, "parameterList"), one = list.first_child(); one;
             one = one.next_sibling()) {
            if (local(one) != "parameter") continue;
            Parameter p;
            p.node = one;
            p.access = attribute(one, "access");
            for (Node child = one.first_child(); child; child = child.next_sibling()) {
                const std::string_view name = local(child);
                if (name == "label" && p.name.empty()) {
                    p.name = trimmed(child.child_value());
                }
                if (name == "defaultValue") {
                    p.default_value = attribute(child, "value");
                }
                if (name == "actualValue") {
                    p.actual_value = attribute(child, "value");
                }
                if (name == "denotation") {
                    p.denotation = trimmed(descendant(child, "label").child_value());
                }
                if (name == "allowedValues") {
                    p.low = attribute(descendant(child, "minValue"), "value");
                    p.high = attribute(descendant(child, "maxValue"), "value");
                }
                for (const IecType& type : iec_types) {
                    if (type.name == name) {
                        p.data_type = type.code;
                    }
                }
            }
            parameters_[attribute(one, "uniqueID")] = std::move(p);
        }
    }

    void identity() {
        for (Node node = descendant(root_, "ProfileBody"); node;) {
            FileInfo& f = out_.file;
            f.file_name = attribute(node, "fileName");
            f.created_by = attribute(node, "fileCreator");
            f.creation_date = european(attribute(node, "fileCreationDate"));
            f.creation_time = attribute(node, "fileCreationTime");
            f.modified_by = attribute(node, "fileModifiedBy");
            f.modification_date = european(attribute(node, "fileModificationDate"));
            f.modification_time = attribute(node, "fileModificationTime");
            if (const std::string version = attribute(node, "fileVersion"); !version.empty()) {
                if (const auto value = parse_number(version.substr(0, version.find('.')));
                    value && value->magnitude <= 0xFF) {
                    f.version = static_cast<std::uint8_t>(value->magnitude);
                }
            }
            break;
        }
        const Node who = descendant(root_, "DeviceIdentity");
        if (!who) return;
        const auto text = [&](const char* name) {
            return std::string(trimmed(descendant(who, name).child_value()));
        };
        const auto id = [&](const char* name) -> std::optional<std::uint32_t> {
            const std::string value = text(name);
            if (value.empty()) return {};
            const auto parsed = parse_number(value);
            const bool valid = parsed && !parsed->node_id && parsed->magnitude <= 0xFFFFFFFF &&
                               (!parsed->negative || parsed->magnitude == 0);
            if (!valid) {
                report(Severity::warning, Topic::number, descendant(who, name),
                       "'" + std::string(name) + "' is not a 32-bit number: '" +
                           value.substr(0, 60) + "'");
                return {};
            }
            report_leading_zero(descendant(who, name), name, *parsed);
            return static_cast<std::uint32_t>(parsed->magnitude);
        };
        DeviceInfo& d = out_.device;
        d.vendor_name = text("vendorName");
        d.vendor_number = id("vendorID");
        d.product_name = text("productName");
        d.product_number = id("productID");
        d.order_code = text("orderNumber");
    }

    /// 2024-01-19 as mm-dd-yyyy
    static std::string european(const std::string& date) {
        return date.size() == 10 && date[4] == '-' ? date.substr(5) + "-" + date.substr(0, 4)
                                                   : date;
    }

    Access access(const Node& node, const std::string& text, const std::string& what) {
        for (const Access one :
             {Access::ro, Access::wo, Access::rw, Access::rwr, Access::rww, Access::constant}) {
            if (same_word(text, name_of(one))) return one;
        }
        if (same_word(text, "read")) return Access::ro;
        if (same_word(text, "write")) return Access::wo;
        if (same_word(text, "readWrite")) return Access::rw;
        if (same_word(text, "readWriteInput")) return Access::rwr;
        if (same_word(text, "readWriteOutput")) return Access::rww;
        if (same_word(text, "constant")) return Access::constant;
        report(Severity::warning, text.empty() ? Topic::missing : Topic::object, node,
               text.empty() ? "'accessType' of " + what + " is missing"
                            : "unknown access type '" + text.substr(0, 40) + "'",
               "read as rw; the access types are ro, wo, rw, rwr, rww, const");
        return Access::rw;
    }

    /// Returns the parameter that an object refers to; nullptr: it has none.
    const Parameter* parameter_of(const Node& node, const std::string& what) {
        const std::string id = attribute(node, "uniqueIDRef");
        const auto found = parameters_.find(id);
        if (found != parameters_.end()) return &found->second;
        if (!id.empty()) {
            report(Severity::warning, Topic::missing, node,
                   what + " refers to parameter '" + id + "', which is not described");
        }
        return nullptr;
    }

    /// Returns an attribute of the object, or else the field of its parameter.
    std::string either(const Node& node, const Parameter* parameter, const char* name,
                       const std::string Parameter::* field) {
        std::string text = attribute(node, name);
        return text.empty() && parameter != nullptr ? parameter->*field : text;
    }

    ObjectType object_type(const Node& node) {
        const auto number_of_type = number(node, "objectType", 9);
        if (!number_of_type) return ObjectType::var;
        const auto type = static_cast<ObjectType>(*number_of_type);
        if (name_of(type) != "?") return type;
        report(Severity::warning, Topic::object, node,
               "there is no object type " + attribute(node, "objectType"), "taken for 7, a VAR");
        return ObjectType::var;
    }

    void read_data_type(const Node& node, const Parameter* parameter, const std::string& what,
                        Entry& out) {
        const std::uint16_t otherwise =
            parameter != nullptr ? parameter->data_type : std::uint16_t{0};
        out.data_type =
            static_cast<std::uint16_t>(number(node, "dataType", 0xFFFF, true).value_or(otherwise));
        if (out.data_type != 0) return;
        if (out.type == ObjectType::var) {
            report(Severity::warning, Topic::missing, node,
                   "the data type of " + what + " is missing",
                   "it can be sent and received as bytes only");
        } else if (out.type == ObjectType::domain) {
            out.data_type = 0x0F;
        }
    }

    void read_access(const Node& node, const Parameter* parameter, const std::string& what,
                     Entry& out) {
        const bool has_attribute = !attribute(node, "accessType").empty();
        if (out.type != ObjectType::var && !has_attribute) return;
        // CiA 311 in XML has it optional for a parameter, with this default; the attribute of an
        // object has none.
        const bool is_default = !has_attribute && parameter != nullptr && parameter->access.empty();
        out.access = access(
            node, is_default ? "read" : either(node, parameter, "accessType", &Parameter::access),
            what);
    }

    void check_values(const Node& node, const std::string& what, const Entry& entry) {
        const DataType* known = data_type(entry.data_type);
        if (known == nullptr || known->kind == Kind::structure || known->kind == Kind::domain) {
            return;
        }
        const auto check = [&](const char* name, const std::string& text) {
            if (text.empty()) return;
            const auto remark =
                remark_on_value("'" + std::string(name) + "' of " + what, text, entry.data_type);
            if (!remark) return;
            report(remark->severity, Topic::value, node, remark->sentence, remark->help);
        };
        check("defaultValue", entry.default_value);
        check("actualValue", entry.parameter_value);
        check("lowLimit", entry.low_limit);
        check("highLimit", entry.high_limit);
    }

    Entry entry(const Node& node, const std::string& what, std::string& denotation) {
        Entry out;
        out.at = place(node);
        const Parameter* parameter = parameter_of(node, what);
        const auto text = [&](const char* name, const std::string Parameter::* field) {
            return either(node, parameter, name, field);
        };
        out.name = text("name", &Parameter::name);
        if (out.name.empty()) {
            report(Severity::warning, Topic::missing, node, "the name of " + what + " is missing",
                   "give the object a name");
        }
        out.type = object_type(node);
        read_data_type(node, parameter, what, out);
        read_access(node, parameter, what, out);
        const std::string mapping = lower(attribute(node, "PDOmapping"));
        out.pdo_mapping = !mapping.empty() && mapping != "no";
        out.default_value = text("defaultValue", &Parameter::default_value);
        out.low_limit = text("lowLimit", &Parameter::low);
        out.high_limit = text("highLimit", &Parameter::high);
        out.parameter_value = text("actualValue", &Parameter::actual_value);
        denotation = text("denotation", &Parameter::denotation);
        if (!attribute(node, "objFlags").empty()) {
            out.flags =
                static_cast<std::uint32_t>(number(node, "objFlags", 0xFFFFFFFF, true).value_or(0));
        }
        check_values(node, what, out);
        return out;
    }

    /// Reads a CANopenObject with its sub-objects, and adds it to the description.
    void object(const Node& node) {
        const auto index = number(node, "index", 0xFFFF, true);
        if (!index) {
            report(Severity::warning, Topic::missing, node,
                   "an object without an index was left out");
            return;
        }
        Object out;
        out.index = static_cast<std::uint16_t>(*index);
        const std::string what = label(out.index);
        if (std::any_of(out_.objects.begin(), out_.objects.end(),
                        [&](const Object& o) { return o.index == out.index; })) {
            report(Severity::warning, Topic::conflict, node,
                   "object " + what + " is described twice", "the first counts");
            return;
        }
        Entry own = entry_of_object(node, what, out);
        out.at = own.at;
        out.name = own.name;
        out.type = own.type;
        out.flags = own.flags;
        out.category = category_of(out.index);
        sub_objects(node, out);
        check_type(node, what, own, out);
        if (!out.single()) {
            out.data_type = own.data_type;
        }
        out_.objects.push_back(std::move(out));
    }

    /// Reads the sub-objects, in the order of their sub-indices.
    void sub_objects(const Node& node, Object& out) {
        for (Node child = node.first_child(); child; child = child.next_sibling()) {
            if (local(child) != "CANopenSubObject") continue;
            const auto sub = number(child, "subIndex", 0xFF, true);
            if (!sub) {
                report(Severity::warning, Topic::object, child,
                       "a sub-index of " + label(out.index) + " without its number was left out");
                continue;
            }
            const std::string what = label(out.index, static_cast<unsigned>(*sub));
            if (out.find(static_cast<std::uint8_t>(*sub)) != nullptr) {
                report(Severity::warning, Topic::object, child, what + " is described twice",
                       "the first counts");
                continue;
            }
            std::string denotation;
            Entry one = entry(child, what, denotation);
            one.denotation = denotation;
            one.sub = static_cast<std::uint8_t>(*sub);
            out.entries.push_back(std::move(one));
        }
        std::sort(out.entries.begin(), out.entries.end(),
                  [](const Entry& a, const Entry& b) { return a.sub < b.sub; });
    }

    /// Makes the object's own entry that of a VAR, and reports a type or a number of sub-objects
    /// that does not agree with them.
    void check_type(const Node& node, const std::string& what, Entry& own, Object& out) {
        if (out.entries.empty() && out.single()) {
            own.flags = 0;
            out.entries.push_back(std::move(own));
            return;
        }
        if (out.single()) {
            report(Severity::warning, Topic::object, node,
                   "object " + what + " is a " + std::string(name_of(out.type)) +
                       ", yet it has sub-indices",
                   "taken for a RECORD");
            out.type = ObjectType::record;
            return;
        }
        const auto stated = number(node, "subNumber", 0x100);
        if (stated && *stated != out.entries.size()) {
            report(Severity::warning, Topic::count, node,
                   "'subNumber' of " + what + " is " + std::to_string(*stated) +
                       ", the file describes " + std::to_string(out.entries.size()));
        }
    }

    Entry entry_of_object(const Node& node, const std::string& what, Object& out) {
        return entry(node, what, out.denotation);
    }

    void network() {
        DeviceInfo& d = out_.device;
        const Node features = descendant(root_, "CANopenGeneralFeatures");

        const Node master = descendant(root_, "CANopenMasterFeatures");
        if (features) {
            d.granularity =
                static_cast<std::uint8_t>(number(features, "granularity", 0xFF).value_or(0));
            d.rx_pdos = static_cast<std::uint16_t>(number(features, "nrOfRxPDO", 512).value_or(0));
            d.tx_pdos = static_cast<std::uint16_t>(number(features, "nrOfTxPDO", 512).value_or(0));
            d.boot_up_slave = flag(features, "bootUpSlave");
            d.group_messaging = flag(features, "groupMessaging");
            d.lss = flag(features, "layerSettingServiceSlave");
            d.dynamic_channels = number(features, "dynamicChannels", 0xFFFF).value_or(0) != 0;
        }
        d.boot_up_master = master && flag(master, "bootUpMaster");
        for (Node rates = descendant(root_, "baudRate"), one = rates.first_child(); one;
             one = one.next_sibling()) {
            if (local(one) != "supportedBaudRate") continue;
            const std::string text = attribute(one, "value");
            const auto rate = parse_number(text.substr(0, text.find(' ')));
            const auto at =
                std::find(baud_rates.begin(), baud_rates.end(), rate ? rate->magnitude : 0);
            if (at != baud_rates.end()) {
                d.supports[static_cast<std::size_t>(at - baud_rates.begin())] = true;
            } else if (text != "auto-baudRate") {
                report(Severity::note, Topic::value, one,
                       "'" + text.substr(0, 40) + "' is not a bit rate of CiA 301");
            }
        }
        for (Node usage = descendant(root_, "dummyUsage"), one = usage.first_child(); one;
             one = one.next_sibling()) {
            const std::string text = attribute(one, "entry");  // Dummy0001=0
            const auto code = text.size() == 11 && same_word(text.substr(0, 5), "dummy")
                                  ? parse_number("0x" + text.substr(5, 4))
                                  : std::nullopt;
            if (code) {
                out_.dummies.emplace_back(static_cast<std::uint16_t>(code->magnitude),
                                          text[10] == '1');
            }
        }
        std::sort(out_.dummies.begin(), out_.dummies.end());
        if (const Node node = descendant(root_, "deviceCommissioning")) {
            Commissioning c;
            c.node_id = static_cast<std::uint8_t>(number(node, "nodeID", 127).value_or(0));
            c.node_name = attribute(node, "nodeName");
            const std::string rate = attribute(node, "actualBaudRate");
            if (const auto value = parse_number(rate.substr(0, rate.find(' ')));
                value && value->magnitude <= 0xFFFF) {
                c.baud_rate = static_cast<std::uint16_t>(value->magnitude);
            }
            c.network =
                static_cast<std::uint32_t>(number(node, "networkNumber", 0xFFFFFFFF).value_or(0));
            c.network_name = attribute(node, "networkName");
            c.manager = flag(node, "CANopenManager");
            out_.commissioning = std::move(c);
        }
    }

    Node root_;
    std::string_view text_;
    std::vector<Message>& messages_;
    std::map<std::string, Parameter> parameters_;
    DeviceDescription out_;
};

}  // namespace

#endif

ReadResult read_xdd(std::string_view bytes) {
    ReadResult out;
    if (!decode(bytes, out.text, out.messages)) return out;
    const auto refuse = [&](std::string sentence, std::string help, Span at = {1, 1, 0, 0}) {
        out.messages.push_back(
            {Severity::error, Topic::unreadable, at, std::move(sentence), std::move(help)});
        return std::move(out);
    };
#if HALCYON_XDD
    pugi::xml_document document;
    const auto parsed = document.load_buffer(out.text.data(), out.text.size(), pugi::parse_default,
                                             pugi::encoding_utf8);
    if (!parsed) {
        const std::size_t at = std::min(
            static_cast<std::size_t>(std::max<std::ptrdiff_t>(parsed.offset, 0)), out.text.size());
        const auto line =
            1 + static_cast<std::uint32_t>(std::count(
                    out.text.begin(), out.text.begin() + static_cast<std::ptrdiff_t>(at), '\n'));
        return refuse(std::string("the XML is broken: ") + parsed.description(), "",
                      {line, 1, static_cast<std::uint32_t>(at), 0});
    }
    if (!descendant(document, "CANopenObjectList")) {
        return refuse("the XML file has no CANopenObjectList",
                      "is it a device description of CANopen (CiA 311)?");
    }
    out.description = Xdd(document, out.text, out.messages).read();
    check_objects(*out.description, out.messages);
    std::stable_sort(out.messages.begin(), out.messages.end(),
                     [](const Message& a, const Message& b) { return a.at.offset < b.at.offset; });
    return out;
#else
    return refuse(
        "XML files (XDD, XDC) are not read by this build: it was made without libpugixml-dev",
        "type: apt-get install libpugixml-dev, then configure again (cmake --preset release) and "
        "build; or use the device's EDS");
#endif
}

ReadResult read_description(std::string_view bytes) {
    std::string_view start = trimmed(bytes.substr(0, 64));
    if (start.substr(0, 3) == "\xEF\xBB\xBF") {
        start.remove_prefix(3);
    }
    const bool wide = start.size() > 3 && ((start[0] == '\xFF' && start[2] == '<') ||
                                           (start[0] == '\xFE' && start[3] == '<'));
    return wide || (!start.empty() && start[0] == '<') ? read_xdd(bytes) : read_eds(bytes);
}

}  // namespace hal::canopen::eds
