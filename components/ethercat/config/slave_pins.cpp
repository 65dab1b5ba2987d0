// SPDX-License-Identifier: MIT
#include "ethercat/config/slave_pins.hpp"

#include <algorithm>

#include "ethercat/config/state_pins.hpp"

namespace hal::ethercat::config {

using master::Type;

namespace {

/// What an option of an object is read into.
struct PinTarget {
    master::Entry& entry;
    PinInfo& info;
    std::string& name;  ///< of the pin in SlaveInfo
    SlaveInput& in;
    bool has_type = false;  ///< a type was read
};

/// Parses a number or a fraction such as 65536/360.
std::optional<double> parse_fraction(std::string_view text) {
    const std::size_t slash = std::min(text.find('/'), text.size());
    const auto over = parse_real(trimmed(text.substr(0, slash)));
    if (slash == text.size()) return over;
    const auto below = parse_real(trimmed(text.substr(slash + 1)));
    if (!over || !below || *below == 0) return std::nullopt;
    return *over / *below;
}

/// The file has object = pin * scale + offset; the setup has the inverse.
void set_scaling(master::Entry& entry, double scale, double offset) {
    entry.scale = 1 / scale;
    entry.offset = -offset / scale;
    entry.scaled = true;
}

bool read_scale(PinTarget& to, const Line& line) {
    const auto scale = parse_fraction(line.value.text);
    if (!scale || *scale == 0) return false;
    set_scaling(to.entry, *scale, -to.entry.offset / to.entry.scale);
    return true;
}

bool read_offset(PinTarget& to, const Line& line) {
    const auto offset = parse_fraction(line.value.text);
    if (!offset) return false;
    set_scaling(to.entry, 1 / to.entry.scale, *offset);
    return true;
}

bool read_unit(PinTarget& to, const Line& line) {
    to.info.unit = line.value.text;
    return true;
}

/// A real of another width is not a number of the object, and would reach into the next one.
void reject_real(PinTarget& to, const Line& line, DataType type) {
    const std::string object = object_text(to.entry.index, to.entry.sub);
    const std::string bits = counted(to.entry.bits, "bit");
    to.in.report.error(Topic::value, line.value.at,
                       "type '" + line.value.text + "' has " + counted(type.bits, "bit") +
                           ", object " + object + " has " + bits,
                       "write an integer type with at least " + bits +
                           ", or float for an integer that is shown as a float");
}

bool read_type(PinTarget& to, const Line& line) {
    master::Entry& entry = to.entry;
    to.has_type = true;
    if (same_word(line.value.text, "float")) {
        entry.scaled = true;
        return true;
    }
    const auto type = parse_type(line.value, to.in.report);
    if (type && is_real(type->type) && type->bits != entry.bits) {
        reject_real(to, line, *type);
        return true;
    }
    const bool fits =
        type && type->bits >= entry.bits && (type->type != Type::bit || entry.bits == 1);
    if (!fits) {
        to.in.keys.reject(line, std::string("float, or one of ") + value_type_names +
                                    " with at least " + counted(entry.bits, "bit"));
        return true;
    }
    entry.type = type->type;
    entry.is_signed = is_signed(type->type);
    return true;
}

bool is_pin_of(const master::Slave& slave, const std::string& name) {
    for (const auto& sm : slave.sync_managers) {
        for (const auto& pdo : sm.pdos) {
            for (const auto& entry : pdo.entries) {
                if (entry.index != 0 && entry.name == name) return true;
            }
        }
    }
    return false;
}

bool is_state_pin(const std::string& name) {
    return std::find(state_pin::all.begin(), state_pin::all.end(), name) != state_pin::all.end();
}

bool read_name(PinTarget& to, const Line& line) {
    const std::string& name = line.value.text;
    if (name.empty() || dashed(name) != name) return false;
    const bool taken = is_pin_of(to.in.slave, name) || is_state_pin(name);
    if (name != to.entry.name && taken) {
        to.in.report.error(Topic::slave, line.value.at, "duplicate pin name '" + name + "'",
                           "choose another one");
        return true;
    }
    to.entry.name = name;
    to.name = name;
    return true;
}

const bus::KeyTable<PinTarget>& option_keys() {
    static const bus::KeyTable<PinTarget> table{{
        {"scale",
         bus::own("a number other than 0, or a fraction such as 65536/360", "a number, a fraction",
                  &read_scale),
         "1", "value of the object = pin · scale + offset. The pin is a float"},
        {"offset",
         bus::own("a number, or a fraction such as 65536/360", "a number, a fraction",
                  &read_offset),
         "0", "offset of the scaling"},
        {"name", bus::own("a name of lower-case letters, digits and dashes", "a name", &read_name),
         "that of the object", "name of the pin"},
        {"unit", bus::own("", "a text", &read_unit), "none",
         "unit of the pin, which is then a float unless its type is given"},
        {"type", bus::own("", "a type, float", &read_type), "by the object",
         "type of the value; `float` makes the pin a float"},
    }};
    return table;
}

}  // namespace

std::string object_reference() { return option_keys().reference("OBJECT."); }

template <class Use>
void SlavePins::for_each_entry(Use use) {
    for (auto& sm : in_.slave.sync_managers) {
        for (auto& pdo : sm.pdos) {
            for (auto& entry : pdo.entries) {
                if (!entry.name.empty()) {
                    use(entry, sm.output);
                }
            }
        }
    }
}

void SlavePins::read() {
    name_pins();
    for (Line* line : in_.keys.rest()) {
        const bool is_option = line->key.text.find('.') != std::string::npos;
        if (!is_option || line->key.text.starts_with("sdo ")) continue;
        line->used = true;
        option(*line);
    }
    for_each_entry([&](master::Entry& entry, bool) {
        // a unit makes the pin a float, unless its type is given
        if (!info_of(entry).unit.empty() && !typed_.contains(&entry)) {
            entry.scaled = true;
        }
    });
}

/// Makes the names unique: an input that is also an output, or a pin of the state of the slave, has
/// the suffix -feedback.
void SlavePins::name_pins() {
    std::set<std::string> names(state_pin::all.begin(), state_pin::all.end());
    for_each_entry([&](master::Entry& entry, bool output) {
        std::string name = entry.name;
        if (names.contains(name) && !output) {
            name += "-feedback";
        }
        for (unsigned n = 2; !names.insert(name).second; ++n) {
            name = entry.name + "-" + std::to_string(n);
        }
        entry.name = name;
    });
}

/// Finds the last entry with this address or name.
master::Entry* SlavePins::find(const Word& object) {
    const auto address = parse_address(object, in_.report);
    master::Entry* found = nullptr;
    std::vector<std::string> names;
    for (auto& sm : in_.slave.sync_managers) {
        for (auto& pdo : sm.pdos) {
            for (auto& entry : pdo.entries) {
                if (entry.index == 0) continue;
                if (!entry.name.empty()) {
                    names.push_back(entry.name);
                }
                const bool is_it =
                    address && entry.index == address->index && entry.sub == address->sub;
                if (is_it || entry.name == object.text) {
                    found = &entry;
                }
            }
        }
    }
    if (found == nullptr) {
        in_.report.error(Topic::object, object.at,
                         "no PDO of this slave has an object '" + object.text + "'",
                         suggestion(object.text, names, "the objects are"));
    }
    return found;
}

PinInfo& SlavePins::info_of(const master::Entry& entry) {
    auto& pins = in_.info.pins;
    auto at = std::find_if(pins.begin(), pins.end(),
                           [&](const auto& pin) { return pin.first == entry.name; });
    if (at == pins.end()) {
        at = pins.insert(at, {entry.name, {"", object_text(entry.index, entry.sub)}});
    }
    return at->second;
}

void SlavePins::option(const Line& line) {
    const std::size_t dot = line.key.text.rfind('.');
    const std::string property = line.key.text.substr(dot + 1);
    master::Entry* entry = find(text::part(line.key, 0, dot));
    if (entry == nullptr) return;
    const auto* key = option_keys().find(property);
    if (key == nullptr) {
        return in_.report.error(Topic::line, line.key.at,
                                "unknown property '" + property + "' of an object",
                                suggestion(property, option_keys().names(), "the properties are"));
    }
    PinInfo& info = info_of(*entry);
    const auto pin = std::find_if(in_.info.pins.begin(), in_.info.pins.end(),
                                  [&](const auto& one) { return &one.second == &info; });
    PinTarget target{*entry, info, pin->first, in_};
    bus::TopicReport<Topic> key_report(in_.report);
    option_keys().read(*key, line, target, key_report);
    if (target.has_type) {
        typed_.insert(entry);
    }
}

}  // namespace hal::ethercat::config
