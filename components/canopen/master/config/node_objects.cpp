// SPDX-License-Identifier: MIT
// How objects become pins: OBJECT.scale, .offset, .unit, .type, .bits, .name, .safe.
#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <set>

#include "node_reader.hpp"

namespace hal::canopen::config {

namespace {

/// Pins that every node has, whatever its PDOs carry; declared in master/pins.hpp.
constexpr const char* node_pins[] = {
    "online",           "operational", "fault",      "state",   "step",
    "error-register",   "emcy",        "emcy-count", "retries", "boot-result",
    "heartbeat-age-ms", "restart"};
constexpr const char* feedback = "-feedback";
constexpr const char* properties[] = {"scale", "offset", "unit", "type", "bits", "name", "safe"};
constexpr Choice<PinType> pin_types[] = {{"bit", PinType::bit}, {"s32", PinType::s32},
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
    return is_signed(type) ? wide ? PinType::s64 : PinType::s32
           : wide          ? PinType::u64
                           : PinType::u32;
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
        const std::int64_t whole = rounded >= static_cast<double>(top) ? top
                                   : rounded <= -static_cast<double>(top) - 1
                                       ? -top - 1
                                       : static_cast<std::int64_t>(rounded);
        return static_cast<std::uint64_t>(whole);
    }
    if (rounded >= static_cast<double>(ones)) return ones;
    if (rounded <= 0) return 0;
    return static_cast<std::uint64_t>(rounded) & ones;
}

void NodeReader::object_options() {
    // The types first: a safe value is in the pin's unit.
    std::vector<Line*> lines = keys_.rest();
    std::vector<std::pair<Object*, std::pair<std::string, const Line*>>> wishes;
    for (Line* line : lines) {
        const std::size_t dot = line->key.text.rfind('.');
        if (dot == line->key.text.npos) continue;
        const std::string object = line->key.text.substr(0, dot);

        const std::string property = line->key.text.substr(dot + 1);
        if (std::find_if(std::begin(properties), std::end(properties),
                         [&](const char* p) { return property == p; }) == std::end(properties)) {
            line->used = true;
            report_.error(Topic::line, line->key.at, "unknown object option '" + property + "'",
                          suggestion(property, {std::begin(properties), std::end(properties)},
                                     "the options are"));
            continue;
        }
        line->used = true;
        bool found = false;
        for (Pdo& pdo : node_.pdos) {
            for (Object& o : pdo.objects) {
                const bool named =
                    !o.filler &&
                    (dashed(object_label(o.index, o.sub)) == dashed(object) || o.about == object ||
                     (o.sub == 0 && lower(object_label(o.index, 0, true)) == object));
                const Known* known = named || o.filler ? nullptr : catalog_->find(o.index, o.sub);
                if (!named && (known == nullptr || known->name != object)) continue;
                found = true;
                wishes.push_back({&o, {property, line}});
            }
        }
        if (found || undescribed_) continue;
        std::vector<std::string> mapped;
        for (const Pdo& pdo : node_.pdos) {
            for (const Object& o : pdo.objects) {
                if (!o.filler && std::find(mapped.begin(), mapped.end(), o.pin) == mapped.end()) {
                    mapped.push_back(o.pin);
                }
            }
        }
        std::string near = did_you_mean(object, mapped);
        report_.error(Topic::object, line->key.at, "no PDO of this node carries '" + object + "'",
                      near.empty() ? "its PDOs carry " + listed(mapped) : near);
    }
    for (const bool types : {true, false}) {
        for (const auto& [o, wish] : wishes) {
            if ((wish.first != "safe") == types) {
                option(*o, wish.first, *wish.second);
            }
        }
    }
}

void NodeReader::option(Object& o, const std::string& property, const Line& line) {
    const std::string& text = line.value.text;
    if (property == "scale" || property == "offset") {
        const auto value = real(text);
        if (!value || (property == "scale" && *value == 0)) {
            return keys_.reject(line,
                                property == "scale"
                                    ? "the object units per pin unit, as in 10000 or 65536/360"
                                    : "a number");
        }
        (property == "scale" ? o.scale : o.offset) = *value;
        o.as = PinType::real;
    } else if (property == "unit") {
        o.unit = text;
        if (keys_.find(line.key.text.substr(0, line.key.text.rfind('.')) + ".type") == nullptr) {
            o.as = PinType::real;
        }
    } else if (property == "name") {
        const auto usable = [](char c) {
            return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                   c == '-' || c == '.' || c == '_' || c == '#';
        };
        if (!std::all_of(text.begin(), text.end(), usable)) {
            return keys_.reject(line, "letters, digits, - and .");
        }
        o.pin = text;
    } else if (property == "type") {
        keys_.take_choice(line.key.text.c_str(), o.as, pin_types);
    } else if (property == "bits") {
        o.bit_pins.clear();
        if (const auto yes = yes_or_no(text)) {
            o.bits_wanted = *yes ? 1 : -1;
            return;
        }
        const auto names = list_of(line.value);
        if (names.size() > o.bits) {
            report_.error(
                Topic::value, line.value.at,
                std::to_string(names.size()) + " names for " + std::to_string(o.bits) + " bits",
                "the first name is that of bit 0; - skips a bit");
            return;
        }
        for (unsigned bit = 0; bit < names.size(); ++bit) {
            if (!names[bit].empty() && names[bit].text != "-") {
                o.bit_pins.push_back({bit, dashed(names[bit].text)});
            }
        }
        o.bits_wanted = 1;
    } else if (!set_safe(o, line)) {
        keys_.reject(line, "a value of the pin, or hold");
    }
}

bool NodeReader::set_safe(Object& o, const Line& line) {
    o.safe_given = true;
    if (lower(line.value.text) == "hold") {
        o.safe.reset();
        return true;
    }
    const auto value = real(line.value.text);
    const auto flag = yes_or_no(line.value.text);
    if (!value && !flag) return false;
    o.safe = raw_of(o, value ? *value : *flag ? 1.0 : 0.0);
    return true;
}

/// An object that the node both receives and sends has two pins: the input keeps the name.
void NodeReader::name_feedback() {
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

void NodeReader::finish_objects() {
    std::set<std::string> pins(std::begin(node_pins), std::end(node_pins));
    struct Seen {
        const Object* object;
        bool to_node;
    };
    std::vector<Seen> seen;
    std::vector<std::string> multiplexed_pins;  // by multiplexed PDOs
    for (Pdo& pdo : node_.pdos) {
        for (Object& o : pdo.objects) {
            if (o.filler) continue;
            if (!o.safe_given) {
                o.safe = pdo.safety ? std::optional<std::uint64_t>(0) : usual_safe(o, pdo.to_node);
            }
            if (o.as == PinType::none) {
                o.as = usual(o.type);
            }
            const bool lines = o.bits_wanted > 0 ||
                               (o.bits_wanted == 0 && is_lines(o.index) && o.as != PinType::real);
            if (lines && o.bit_pins.empty()) {
                name_bits(o);
            }
        }
    }
    name_feedback();
    for (Pdo& pdo : node_.pdos) {
        for (Object& o : pdo.objects) {
            if (o.filler) continue;
            // A second PDO with the same object shares its pins.
            const bool again = std::any_of(seen.begin(), seen.end(), [&](const Seen& s) {
                return s.to_node == pdo.to_node && s.object->same(o);
            });
            if (again &&
                (pdo.multiplexed() || std::find(multiplexed_pins.begin(), multiplexed_pins.end(),
                                                o.pin) != multiplexed_pins.end())) {
                report_.error(Topic::object, pdo.at,
                              "object '" + o.pin + "' is in two PDOs, one of them multiplexed",
                              "remove it from one of them");
            }
            if (pdo.multiplexed()) {
                multiplexed_pins.push_back(o.pin);
            }
            if (again) continue;
            seen.push_back({&o, pdo.to_node});
            const auto claim = [&](const std::string& name) {
                if (std::find(std::begin(node_pins), std::end(node_pins), name) !=
                    std::end(node_pins)) {
                    report_.error(
                        Topic::object, pdo.at, "pin '" + name + "' exists on every node",
                        "rename the object: " + object_label(o.index, o.sub) + ".name = NAME");
                } else if (!pins.insert(name).second) {
                    report_.error(
                        Topic::object, pdo.at,
                        "duplicate pin '" + name + "': two objects have this name",
                        "rename one of them: " + object_label(o.index, o.sub) + ".name = NAME");
                }
            };
            if (o.bit_pins.empty()) {
                claim(o.pin);
            }
            for (const BitPin& b : o.bit_pins) {
                claim(b.name);
            }
        }
    }
}

void NodeReader::leftover() {
    const std::vector<std::string> all{"type",
                                       "eds",
                                       "device",
                                       "axes",
                                       "device-type",
                                       "vendor",
                                       "product",
                                       "revision",
                                       "serial",
                                       "mandatory",
                                       "configure",
                                       "keep-alive",
                                       "start",
                                       "start-order",
                                       "restore",
                                       "save",
                                       "boot-time",
                                       "retry",
                                       "retry-most",
                                       "on-failure",
                                       "on-loss",
                                       "heartbeat",
                                       "silence",
                                       "guarding",
                                       "watch-master",
                                       "firmware",
                                       "firmware-number",
                                       "firmware-id",
                                       "firmware-version",
                                       "firmware-time",
                                       "tpdo1",
                                       "rpdo1",
                                       "tsrdo1",
                                       "rsrdo2",
                                       "sdo-timeout",
                                       "sdo-retries",
                                       "configured",
                                       "write OBJECT",
                                       "command OBJECT"};
    for (Line* line : keys_.rest()) {
        line->used = true;
        report_.error(Topic::line, line->key.at, "unknown key '" + line->key.text + "' of a node",
                      suggestion(line->key.text, all, "the keys are"));
    }
}

}  // namespace hal::canopen::config
