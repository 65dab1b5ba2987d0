// SPDX-License-Identifier: MIT
// The object dictionary of an ESI: objects refer to data types by name, which consist of sub-items
// or array elements.
#include <map>

#include "esi_xml.hpp"

namespace hal::ethercat::esi {

namespace {

constexpr std::size_t max_values = 300'000;

struct Flags {
    bool given = false;
    bool readable = true;
    bool writable = false;
    bool rx = false;
    bool tx = false;
};

Flags flags_of(const Xml& item) {
    const Xml flags = item.child("Flags");
    Flags out;
    if (!flags) return out;
    const std::string access = lower(trimmed(flags.child_value("Access")));

    const std::string mapping = lower(trimmed(flags.child_value("PdoMapping")));
    out.given = true;
    out.readable = access != "wo";
    out.writable = access == "rw" || access == "wo";
    out.rx = mapping.find('r') != std::string::npos;

    out.tx = mapping.find('t') != std::string::npos;
    return out;
}

struct SubItem {
    int sub = -1;  ///< none: elements of an array
    std::string name, type;
    unsigned bits = 0;
    Flags flags;
};
struct DataType {
    std::string base;
    unsigned bits = 0;
    bool array = false;
    unsigned first = 0;
    unsigned elements = 0;
    std::vector<SubItem> items;
};

class Dictionary {
public:
    Dictionary(Context& context, const Xml& dictionary) : context_(context) {
        for (const Xml type : dictionary.child("DataTypes").children("DataType")) {
            data_type(type);
        }
        for (const Xml object : dictionary.child("Objects").children("Object")) {
            if (values_ > max_values) {
                context_.warn(object, "the dictionary has more than " + std::to_string(max_values) +
                                          " values; the rest is ignored");
                break;
            }
            add(object);
        }
    }
    std::vector<Object> take() {
        std::vector<Object> out;
        for (auto& [index, object] : objects_) {
            out.push_back(std::move(object));
        }
        return out;
    }

private:
    void data_type(const Xml& node) {
        DataType t;
        t.base = trimmed(node.child_value("BaseType"));
        t.bits = size(node);
        if (const Xml array = node.child("ArrayInfo")) {
            t.array = true;
            t.first = std::min(context_.child<unsigned>(array, "LBound", 1), 255U);
            t.elements = std::min(context_.child<unsigned>(array, "Elements", 0), 256U);
        }
        for (const Xml item : node.children("SubItem")) {
            SubItem s;
            if (item.child("SubIdx")) {
                s.sub = context_.child<int>(item, "SubIdx", -1) & 0xff;
            }
            s.name = text_of(item, "Name");
            s.type = trimmed(item.child_value("Type"));
            s.bits = size(item);
            s.flags = flags_of(item);
            t.items.push_back(std::move(s));
        }
        types_[std::string(trimmed(node.child_value("Name")))] = std::move(t);
    }
    unsigned size(const Xml& node) {
        return std::min(context_.child<unsigned>(node, "BitSize", 0), 8U * 65536);
    }

    /// Returns the basic type behind a name: enumerations and other names of one have it as their
    /// base.
    std::string basic(std::string name) const {
        for (int depth = 0; depth < 8 && type_bits(name) == 0; ++depth) {
            const auto at = types_.find(name);
            if (at == types_.end() || at->second.base.empty()) break;
            name = at->second.base;
        }
        return name;
    }

    void value(Object& o, unsigned sub, const std::string& name, const std::string& type,
               unsigned bits, const Flags& flags, const Flags& otherwise) {
        if (sub > 255 || o.find(static_cast<std::uint8_t>(sub)) != nullptr) return;
        const Flags& f = flags.given ? flags : otherwise;
        Value v;
        v.sub = static_cast<std::uint8_t>(sub);
        v.name = name;
        v.type = basic(type);
        v.bits = type_bits(v.type) != 0 ? type_bits(v.type) : bits;
        v.readable = f.readable;
        v.writable = f.writable;
        v.rx_mappable = f.rx;

        v.tx_mappable = f.tx;
        o.values.push_back(std::move(v));
        ++values_;
    }

    void array(Object& o, const DataType& t, const Flags& flags, const Flags& otherwise) {
        const unsigned bits = t.elements == 0 ? 0 : t.bits / t.elements;
        for (unsigned i = 0; i < t.elements; ++i) {
            value(o, std::max(t.first, 1U) + i,
                  "SubIndex " + std::to_string(std::max(t.first, 1U) + i), t.base, bits, flags,
                  otherwise);
        }
    }

    void add(const Xml& node) {
        Object o;
        const std::int64_t index = context_.child<std::int64_t>(node, "Index", -1);
        if (index < 0 || index > 0xffff) return;
        o.index = static_cast<std::uint16_t>(index);
        o.name = text_of(node, "Name");
        o.type = trimmed(node.child_value("Type"));
        const Flags flags = flags_of(node);
        const auto at = types_.find(o.type);
        if (at != types_.end() && !at->second.items.empty()) {
            o.code = Object::Code::record;
            for (const SubItem& s : at->second.items) {
                const auto inner = types_.find(s.type);
                if (inner != types_.end() && inner->second.array) {
                    o.code = Object::Code::array;
                    array(o, inner->second, s.flags, flags);
                } else {
                    value(o,
                          s.sub < 0 ? static_cast<unsigned>(o.values.size())
                                    : static_cast<unsigned>(s.sub),
                          s.name, s.type, s.bits, s.flags, flags);
                }
            }
        } else if (at != types_.end() && at->second.array) {
            o.code = Object::Code::array;
            value(o, 0, "SubIndex 000", "USINT", 8, {}, {});
            array(o, at->second, {}, flags);
        } else {
            value(o, 0, o.name, o.type, size(node), flags, flags);
        }
        initial(node, o);
        std::sort(o.values.begin(), o.values.end(),
                  [](const Value& a, const Value& b) { return a.sub < b.sub; });
        objects_.try_emplace(o.index, std::move(o));  // the first of duplicates
    }

    /// The initial values are in the order of the sub-items, without sub-indices.
    void initial(const Xml& node, Object& o) {
        const Xml info = node.child("Info");
        if (o.values.empty()) return;
        if (!info.child("SubItem")) {
            set(info, o.values.front());
        }
        std::size_t i = 0;
        for (const Xml item : info.children("SubItem")) {
            if (i == o.values.size()) break;
            if (const std::string name = text_of(item, "Name");
                o.code == Object::Code::array && !name.empty() && i != 0) {
                o.values[i].name = name;
            }
            set(item.child("Info"), o.values[i++]);
        }
        Value& count = o.values.front();
        if (count.sub == 0 && count.initial.empty() && o.code != Object::Code::variable) {
            unsigned highest = 0;
            for (const Value& v : o.values) {
                highest = std::max<unsigned>(highest, v.sub);
            }
            count.initial = {static_cast<std::uint8_t>(highest)};
        }
    }
    void set(const Xml& info, Value& to) {
        if (const Xml data = info.child("DefaultData")) {
            to.initial = context_.bytes(data);
        } else if (const Xml text = info.child("DefaultString")) {
            const std::string_view s = text.child_value();
            to.initial.assign(s.begin(), s.end());
        } else if (const Xml value = info.child("DefaultValue")) {
            if (to.type.starts_with("STRING")) {
                const std::string_view s = value.child_value();
                to.initial.assign(s.begin(), s.end());
            } else if (to.bits <= 64) {
                const auto n = static_cast<std::uint64_t>(
                    context_.number_of<std::int64_t>(value, "DefaultValue", value.child_value()));
                for (unsigned i = 0; i < (to.bits + 7) / 8; ++i) {
                    to.initial.push_back(static_cast<std::uint8_t>(n >> (8 * i)));
                }
            }
        }
    }

    Context& context_;
    std::map<std::string, DataType> types_;
    std::map<std::uint16_t, Object> objects_;
    std::size_t values_ = 0;
};

}  // namespace

std::vector<Object> dictionary(Context& context, const Xml& profile) {
    const Xml node = profile.child("Dictionary");
    return node ? Dictionary(context, node).take() : std::vector<Object>{};
}

namespace {

/// Returns the bits of "ARRAY [0..3] OF UINT"; 0: the text is invalid, or the array too large.
unsigned array_bits(std::string_view type) {
    const std::size_t open = type.find('[');
    const std::size_t dots = type.find("..", open);
    const std::size_t close = type.find(']', open);
    const std::size_t of = type.find(" OF ", close);
    if (open == type.npos || dots == type.npos || close == type.npos || of == type.npos ||
        dots > close) {
        return 0;
    }
    const auto first = number(type.substr(open + 1, dots - open - 1));
    const auto last = number(type.substr(dots + 2, close - dots - 2));
    const std::string_view element = trimmed(type.substr(of + 4));
    if (!first || !last || *last < *first || *last - *first > 65535 ||
        element.starts_with("ARRAY")) {
        return 0;
    }
    const std::uint64_t bits = static_cast<std::uint64_t>(*last - *first + 1) * type_bits(element);
    return bits > 8U * 65536 ? 0 : static_cast<unsigned>(bits);
}

}  // namespace

unsigned type_bits(std::string_view type) {
    struct Basic {
        std::string_view name;
        unsigned bits;
    };
    constexpr Basic basics[] = {{"BOOL", 1},    {"BIT", 1},       {"BYTE", 8},     {"WORD", 16},
                                {"DWORD", 32},  {"LWORD", 64},    {"SINT", 8},     {"INT", 16},
                                {"DINT", 32},   {"LINT", 64},     {"USINT", 8},    {"UINT", 16},
                                {"UDINT", 32},  {"ULINT", 64},    {"INT24", 24},   {"INT40", 40},
                                {"INT48", 48},  {"INT56", 56},    {"UINT24", 24},  {"UINT40", 40},
                                {"UINT48", 48}, {"UINT56", 56},   {"REAL", 32},    {"LREAL", 64},
                                {"BITARR8", 8}, {"BITARR16", 16}, {"BITARR32", 32}};
    for (const Basic& b : basics) {
        if (b.name == type) return b.bits;
    }
    if (type.starts_with("BIT") && type.size() <= 5) {
        if (const auto n = number(type.substr(3)); n && *n >= 1 && *n <= 16) {
            return static_cast<unsigned>(*n);
        }
    }
    if (type.starts_with("STRING(") && type.ends_with(")")) {
        if (const auto n = number(type.substr(7, type.size() - 8)); n && *n >= 0 && *n <= 65535) {
            return static_cast<unsigned>(8 * *n);
        }
    }
    return type.starts_with("ARRAY") ? array_bits(type) : 0;
}

}  // namespace hal::ethercat::esi
