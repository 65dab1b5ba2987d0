// SPDX-License-Identifier: MIT
#include "node_objects.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <set>

#include "text/characters.hpp"

namespace hal::canopen::config {

namespace {

/// Pins that every node has, whatever its PDOs carry; declared in master/pins.hpp.
constexpr const char* node_pins[] = {
    "online",           "operational", "fault",      "state",   "step",
    "error-register",   "emcy",        "emcy-count", "retries", "boot-result",
    "heartbeat-age-ms", "restart"};
constexpr const char* feedback = "-feedback";
constexpr bus::Choice<PinType> pin_types[] = {{"bit", PinType::bit}, {"s32", PinType::s32},
                                              {"u32", PinType::u32}, {"s64", PinType::s64},
                                              {"u64", PinType::u64}, {"float", PinType::real}};

std::optional<double> real(std::string_view text) {
    const std::size_t slash = text.find('/');
    if (slash != text.npos) {
        const auto above = real(text.substr(0, slash));
        const auto below = real(text.substr(slash + 1));
        return above && below && *below != 0 ? std::optional(*above / *below) : std::nullopt;
    }
    text = trimmed(text);
    if (const auto number = parse_natural(text)) return static_cast<double>(*number);
    return parse_real(text);
}

PinType usual(Type type) {
    if (type == Type::boolean) return PinType::bit;
    if (is_real(type)) return PinType::real;
    const bool wide = bits_of(type) > 32;
    if (is_signed(type)) return wide ? PinType::s64 : PinType::s32;
    return wide ? PinType::u64 : PinType::u32;
}

/// Inputs and outputs of CiA 401 whose bits are lines of their own.
bool is_lines(std::uint16_t index) {
    return index == 0x6000 || index == 0x6100 || index == 0x6120 || index == 0x6200 ||
           index == 0x6300 || index == 0x6320;
}

/// The default safe value of an output when its node or the machine stops: standstill, voltage
/// removed where that is safe.
std::optional<std::uint64_t> usual_safe(const Object& o, bool to_node) {
    const std::uint16_t drive =
        o.index >= 0x6000 && o.index < 0xa000
            ? static_cast<std::uint16_t>(0x6000 + (o.index - 0x6000) % 0x800)
            : std::uint16_t{0};
    if (!to_node) return drive == 0x6041 ? std::optional<std::uint64_t>(0) : std::nullopt;
    if (drive == 0x6040) {
        return 0x0002;  // quick stop: brakes, then removes the voltage
    }
    if (drive == 0x60ff || drive == 0x6071 || drive == 0x6042) return 0;
    if (is_lines(o.index) || (o.index >= 0x6410 && o.index <= 0x6413)) return 0;
    return {};
}

void name_bits(Object& o) {
    const std::string pattern = o.pin.find('#') == o.pin.npos ? o.pin + "-#" : o.pin;
    const std::size_t at = pattern.find('#');

    const std::size_t width = std::min(pattern.find_first_not_of('#', at), pattern.size()) - at;
    for (unsigned bit = 0; bit < o.bits; ++bit) {
        std::string digits = std::to_string(bit);
        if (digits.size() < width) {
            digits.insert(0, width - digits.size(), '0');
        }
        std::string name = pattern;
        o.bit_pins.push_back({bit, name.replace(at, width, digits)});
    }
}

}  // namespace

std::uint64_t raw_of(const Object& o, double pin_value) {
    const double value = pin_value * o.scale + o.offset;
    if (o.type == Type::real32) return std::bit_cast<std::uint32_t>(static_cast<float>(value));
    if (o.type == Type::real64) return std::bit_cast<std::uint64_t>(value);
    if (std::isnan(value)) return 0;
    const unsigned bits = o.bits == 0 || o.bits > 64 ? 64 : o.bits;
    const std::uint64_t ones = bits == 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << bits) - 1;
    const double rounded = std::nearbyint(value);
    if (is_signed(o.type)) {
        const auto top = static_cast<std::int64_t>(ones >> 1);
        if (rounded >= static_cast<double>(top)) return static_cast<std::uint64_t>(top);
        if (rounded <= -static_cast<double>(top) - 1) return static_cast<std::uint64_t>(-top - 1);
        return static_cast<std::uint64_t>(static_cast<std::int64_t>(rounded));
    }
    if (rounded >= static_cast<double>(ones)) return ones;
    if (rounded <= 0) return 0;
    return static_cast<std::uint64_t>(rounded) & ones;
}

namespace {

/// What an option of an object is read into.
struct ObjectTarget {
    Object& object;
    Report& report;
};

bool read_scale(ObjectTarget& to, const Line& line) {
    const auto value = real(line.value.text);
    if (!value || *value == 0) return false;
    to.object.scale = *value;
    to.object.as = PinType::real;
    return true;
}

bool read_offset(ObjectTarget& to, const Line& line) {
    const auto value = real(line.value.text);
    if (!value) return false;
    to.object.offset = *value;
    to.object.as = PinType::real;
    return true;
}

bool read_unit(ObjectTarget& to, const Line& line) {
    to.object.unit = line.value.text;
    return true;
}

bool read_name(ObjectTarget& to, const Line& line) {
    const std::string& text = line.value.text;
    const auto usable = [](char c) { return is_name_character(c) || c == '#'; };
    if (!std::all_of(text.begin(), text.end(), usable)) return false;
    to.object.pin = text;
    return true;
}

/// Reads yes, no, or the names of the bits.
bool read_bits(ObjectTarget& to, const Line& line) {
    Object& o = to.object;
    o.bit_pins.clear();
    if (const auto yes = bus::parse_flag(line.value.text)) {
        o.bits_wanted = *yes ? 1 : -1;
        return true;
    }
    const auto names = list_of(line.value);
    if (names.size() > o.bits) {
        to.report.error(
            Topic::value, line.value.at,
            std::to_string(names.size()) + " names for " + std::to_string(o.bits) + " bits",
            "the first name is that of bit 0; - skips a bit");
        return true;
    }
    for (unsigned bit = 0; bit < names.size(); ++bit) {
        if (!names[bit].empty() && names[bit].text != "-") {
            o.bit_pins.push_back({bit, dashed(names[bit].text)});
        }
    }
    o.bits_wanted = 1;
    return true;
}

bool read_safe(ObjectTarget& to, const Line& line) {
    Object& o = to.object;
    o.safe_given = true;
    if (same_word(line.value.text, "hold")) {
        o.safe.reset();
        return true;
    }
    if (const auto value = real(line.value.text)) {
        o.safe = raw_of(o, *value);
        return true;
    }
    const auto flag = bus::parse_flag(line.value.text);
    if (!flag) return false;
    o.safe = raw_of(o, *flag ? 1.0 : 0.0);
    return true;
}

/// `safe` is the last row: its value is in the unit of the pin, which the others define.
const bus::KeyTable<ObjectTarget>& option_keys() {
    const auto type = [](ObjectTarget& to) -> PinType& { return to.object.as; };
    static const bus::KeyTable<ObjectTarget> table{{
        {"scale",
         bus::own("the object units per pin unit, as in 10000 or 65536/360", "a number, a fraction",
                  &read_scale),
         "1", "scale factor: object = pin · scale + offset; may be a fraction, `65536/360`"},
        {"offset", bus::own("a number", "a number, a fraction", &read_offset), "0",
         "offset of the scaling"},
        {"unit", bus::own("", "a text", &read_unit), "none",
         "unit of the pin, which is then a float unless its type is given"},
        {"type", bus::choice(type, pin_types), "by the object", "type of the pin"},
        {"bits", bus::own("", "yes, no, names", &read_bits),
         "`yes` for digital inputs and outputs of CiA 401, else `no`",
         "`yes`: one pin per bit, `NAME-0` and so on; a list names the pins: `home, limit-min, -, "
         "limit-max`; `no`: one pin"},
        {"name", bus::own("letters, digits, - and .", "a name", &read_name), "that of the object",
         "name of the pin"},
        {"safe", bus::own("a value of the pin, or hold", "a value, hold", &read_safe), "see below",
         "safe value. The master sends it for an output while the node is not operational and when "
         "the machine stops; the pin of an input shows it while the node is not operational and "
         "while the thread of the master is stopped. `hold`: the last value"},
    }};
    return table;
}

}  // namespace

std::string object_reference() { return option_keys().reference("OBJECT."); }

void NodeObjects::read() {
    const std::vector<Option> all = options();
    bus::TopicReport<Topic> key_report(report_);
    for (const bool is_safe : {false, true}) {
        for (const Option& option : all) {
            if ((option.property == "safe") != is_safe) continue;
            ObjectTarget target{*option.object, report_};
            option_keys().read(*option_keys().find(option.property), *option.line, target,
                               key_report);
        }
    }
    complete();
    name_feedback();
    check_pins();
}

std::vector<NodeObjects::Option> NodeObjects::options() {
    std::vector<Option> out;
    for (Line* line : keys_.rest()) {
        const std::size_t dot = line->key.text.rfind('.');
        if (dot == line->key.text.npos) continue;
        line->used = true;
        const std::string property = line->key.text.substr(dot + 1);
        if (option_keys().find(property) == nullptr) {
            report_.error(Topic::line, line->key.at, "unknown object option '" + property + "'",
                          suggestion(property, option_keys().names(), "the options are"));
            continue;
        }
        const Word word = text::part(line->key, 0, dot);
        const auto objects = objects_named(word.text, word);
        for (Object* object : objects) {
            out.push_back({object, property, line});
        }
        if (objects.empty() && !in_.undescribed) {
            report_unmapped(word.text, *line);
        }
    }
    return out;
}

/// Finds the objects of all PDOs that a key names: by address, or by a name of the description.
std::vector<Object*> NodeObjects::objects_named(const std::string& name, const Word& word) {
    const Known* known = in_.catalog.find(name);
    const auto address = known == nullptr ? parse_address(word, report_) : std::nullopt;
    const auto is_named = [&](const Object& o) {
        if (o.filler) return false;
        if (address) return o.index == address->index && o.sub == address->sub;
        if (known != nullptr && o.index == known->index && o.sub == known->sub) return true;
        return o.about == name || dashed(object_text(o.index, o.sub)) == dashed(name);
    };
    std::vector<Object*> out;
    for (Pdo& pdo : node_.pdos) {
        for (Object& o : pdo.objects) {
            if (is_named(o)) {
                out.push_back(&o);
            }
        }
    }
    return out;
}

void NodeObjects::report_unmapped(const std::string& name, const Line& line) {
    std::vector<std::string> mapped;
    for (const Pdo& pdo : node_.pdos) {
        for (const Object& o : pdo.objects) {
            if (!o.filler && std::find(mapped.begin(), mapped.end(), o.pin) == mapped.end()) {
                mapped.push_back(o.pin);
            }
        }
    }
    const std::string near = did_you_mean(name, mapped);
    report_.error(Topic::object, line.key.at, "no PDO of this node carries '" + name + "'",
                  near.empty() ? "its PDOs carry " + listed(mapped) : near);
}

/// Sets the type, the safe value and the pins of bits that are not given.
void NodeObjects::complete() {
    for (Pdo& pdo : node_.pdos) {
        for (Object& o : pdo.objects) {
            if (o.filler) continue;
            if (!o.safe_given) {
                o.safe = pdo.safety ? std::optional<std::uint64_t>(0) : usual_safe(o, pdo.to_node);
            }
            if (o.as == PinType::none) {
                o.as = o.unit.empty() ? usual(o.type) : PinType::real;
            }
            const bool lines = o.bits_wanted > 0 ||
                               (o.bits_wanted == 0 && is_lines(o.index) && o.as != PinType::real);
            if (lines && o.bit_pins.empty()) {
                name_bits(o);
            }
        }
    }
}

/// An object that the node both receives and sends has two pins: the input keeps the name.
void NodeObjects::name_feedback() {
    for (const Pdo& sent : node_.pdos) {
        if (!sent.to_node) continue;
        for (const Object& o : sent.objects) {
            for (Pdo& back : node_.pdos) {
                if (back.to_node) continue;
                for (Object& same : back.objects) {
                    if (!same.same(o) || same.pin != o.pin) continue;
                    same.pin += feedback;
                    for (BitPin& b : same.bit_pins) {
                        b.name += feedback;
                    }
                }
            }
        }
    }
}

namespace {

/// The pins of a node, to find those that two objects have.
class PinNames {
public:
    PinNames(Report& report) : report_(report) {}

    void claim(const Object& o, const std::string& name, Span at) {
        const std::string rename = object_text(o.index, o.sub) + ".name = NAME";
        if (std::find(std::begin(node_pins), std::end(node_pins), name) != std::end(node_pins)) {
            report_.error(Topic::object, at, "pin '" + name + "' exists on every node",
                          "rename the object: " + rename);
        } else if (!names_.insert(name).second) {
            report_.error(Topic::object, at,
                          "duplicate pin '" + name + "': two objects have this name",
                          "rename one of them: " + rename);
        }
    }

private:
    Report& report_;
    std::set<std::string> names_;
};

}  // namespace

void NodeObjects::check_pins() {
    struct Seen {
        const Object* object;
        bool to_node;
    };
    PinNames pins(report_);
    std::vector<Seen> seen;
    std::set<std::string> multiplexed;  // pins of multiplexed PDOs
    for (const Pdo& pdo : node_.pdos) {
        for (const Object& o : pdo.objects) {
            if (o.filler) continue;
            // A second PDO with the same object shares its pins.
            const bool again = std::any_of(seen.begin(), seen.end(), [&](const Seen& s) {
                return s.to_node == pdo.to_node && s.object->same(o);
            });
            if (again && (pdo.multiplexed() || multiplexed.contains(o.pin))) {
                report_.error(Topic::object, pdo.at,
                              "object '" + o.pin + "' is in two PDOs, one of them multiplexed",
                              "remove it from one of them");
            }
            if (pdo.multiplexed()) {
                multiplexed.insert(o.pin);
            }
            if (again) continue;
            seen.push_back({&o, pdo.to_node});
            if (o.bit_pins.empty()) {
                pins.claim(o, o.pin, pdo.at);
            }
            for (const BitPin& b : o.bit_pins) {
                pins.claim(o, b.name, pdo.at);
            }
        }
    }
}

}  // namespace hal::canopen::config
