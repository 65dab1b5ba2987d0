// SPDX-License-Identifier: MIT
// A node's PDOs: rpdoN and tpdoN, their objects and options.
#include <algorithm>

#include "node_reader.hpp"

namespace hal::canopen::config {

namespace {

std::string upper(std::string text) {
    for (char& c : text) {
        c = static_cast<char>(c >= 'a' && c <= 'z' ? c - 'a' + 'A' : c);
    }
    return text;
}

}  // namespace

std::map<std::pair<bool, unsigned>, NodeReader::PdoWish> NodeReader::wishes(const char* what,
                                                                            unsigned most) {
    std::map<std::pair<bool, unsigned>, PdoWish> out;
    for (const bool to_node : {true, false}) {
        const std::string beginning = std::string(to_node ? "r" : "t") + what;
        for (Line* line : keys_.all_of(beginning)) {
            const std::string rest = line->key.text.substr(beginning.size());
            const std::size_t dot = std::min(rest.find('.'), rest.size());
            const auto number = parse_natural(rest.substr(0, dot));
            if (!number) {
                continue;  // an object whose name begins alike
            }
            line->used = true;
            if (*number < 1 || *number > most) {
                report_.error(Topic::value, line->key.at,
                              "invalid " + upper(what) + " number " + std::to_string(*number),
                              upper(what) + "s are numbered 1.." + std::to_string(most));
                continue;
            }
            PdoWish& wish = out[{to_node, static_cast<unsigned>(*number)}];
            wish.number = static_cast<unsigned>(*number);
            wish.to_node = to_node;
            if (dot == rest.size()) {
                wish.objects = line;
            } else {
                wish.options[rest.substr(dot + 1)] = line;
            }
        }
    }
    return out;
}

void NodeReader::pdos() {
    auto wished = wishes();
    const bool mentioned = std::any_of(wished.begin(), wished.end(),
                                       [](const auto& w) { return w.second.objects != nullptr; });
    for (unsigned number = 1; number <= 512; ++number) {
        for (const bool to_node : {true, false}) {
            const auto base =
                static_cast<std::uint16_t>((to_node ? 0x1400U : 0x1800U) + number - 1);
            const bool on = (catalog_->number(base, 1, cob_invalid) & cob_invalid) == 0 &&
                            catalog_->number(static_cast<std::uint16_t>(base + 0x200), 0, 0) != 0;
            const auto wish = wished.find({to_node, number});
            if (wish != wished.end()) {
                if (wish->second.objects != nullptr || (on && !mentioned)) {
                    pdo(wish->second);
                } else {
                    const Line& line = *wish->second.options.begin()->second;
                    report_.error(Topic::node, line.key.at,
                                  std::string(to_node ? "rpdo" : "tpdo") + std::to_string(number) +
                                      " has options but no objects",
                                  "name its objects: " + std::string(to_node ? "rpdo" : "tpdo") +
                                      std::to_string(number) + " = OBJECT, OBJECT, or = default");
                }
            } else if (on && !mentioned) {
                pdo({number, to_node});
            } else if (on) {  // a PDO that is not named stays off the bus
                auto off = to_node ? rpdo_writes(number, {}, node_.setup.id)
                                   : tpdo_writes(number, {}, node_.setup.id);
                std::move(off.begin(), off.end(), std::back_inserter(node_.setup.writes));
            }
        }
    }
}

void NodeReader::pdo(const PdoWish& wish) {
    Pdo pdo;
    pdo.to_node = wish.to_node;
    pdo.number = wish.number;
    pdo.at = wish.objects != nullptr ? wish.objects->value.at : node_.at;
    const std::string word = wish.objects != nullptr ? lower(wish.objects->value.text) : "default";
    const auto base =
        static_cast<std::uint16_t>((wish.to_node ? 0x1400U : 0x1800U) + wish.number - 1);
    if (word == "none") {
        auto off = wish.to_node ? rpdo_writes(wish.number, {}, node_.setup.id)
                                : tpdo_writes(wish.number, {}, node_.setup.id);
        std::move(off.begin(), off.end(), std::back_inserter(node_.setup.writes));
        return;
    }
    pdo.transmission = bus_.sync != SyncMode::none ? 1 : 255;
    if (word == "default") {
        if (!default_objects(wish, pdo)) return;
        pdo.transmission = static_cast<std::uint8_t>(catalog_->number(base, 2, 255));
        pdo.inhibit_100us = static_cast<std::uint16_t>(catalog_->number(base, 3, 0));
        pdo.event_ms = static_cast<std::uint16_t>(catalog_->number(base, 5, 0));
    } else if (word.starts_with("mpdo ")) {
        pdo.multiplex = wish.to_node ? Multiplex::destination_address : Multiplex::source_address;
        pdo.transmission = 255;
        Word rest = wish.objects->value;
        rest.text.erase(0, 5);
        rest.at.offset += 5;
        rest.at.column += 5;
        rest.at.length -= 5;
        objects_of(rest, pdo);
        std::erase_if(pdo.objects, [&](const Object& o) { return !multiplexable(o, pdo); });
    } else {
        objects_of(wish.objects->value, pdo);
    }
    const auto described = static_cast<std::uint32_t>(catalog_->number(base, 1, cob_invalid));
    if ((described & cob_invalid) == 0 && cob_id(described) != 0) {
        pdo.cob = described & (cob_extended | 0x1fffffff);
    } else if (wish.number <= 4) {
        pdo.cob = (wish.to_node ? 0x100U : 0x80U) + 0x100 * wish.number + node_.setup.id;
    }
    pdo_options(wish, pdo);
    if (pdo.multiplexed()) {
        for (const char* key : {"transmission", "request"}) {
            if (const auto given = wish.options.find(key);
                given != wish.options.end() && pdo.transmission < 254) {
                report_.error(Topic::node, given->second->value.at,
                              "a multiplexed PDO is sent when an object changes",
                              "write transmission = event, or delete the line");
            }
        }
        if (!pdo.objects.empty()) {
            node_.pdos.push_back(std::move(pdo));
        }
    } else if (pdo.bits() > 64) {
        report_.error(
            Topic::object, pdo.at,
            "these objects have " + std::to_string(pdo.bits()) + " bits; a PDO carries 64",
            "move some to another PDO");
    } else if (!pdo.objects.empty()) {
        node_.pdos.push_back(std::move(pdo));
    }
}

bool NodeReader::multiplexable(const Object& o, const Pdo& pdo) {
    if (!o.filler && o.bits <= 32 && o.bits % 8 == 0) return true;
    report_.error(Topic::object, pdo.at,
                  o.filler ? std::string("a multiplexed PDO has no gaps")
                           : "object '" + o.pin + "' has " + std::to_string(o.bits) + " bits",
                  "a multiplexed PDO carries one object of 8, 16, 24 or 32 bits at a time");
    return false;
}

namespace {

constexpr std::uint8_t rtr_synchronous = 252;  // transmission types
constexpr std::uint8_t rtr_event_driven = 253;

/// The transmission type that a text names; nothing when it names none.
std::optional<std::uint64_t> transmission_of(const Word& text) {
    const std::string value = lower(text.text);
    if (value == "sync") return 1;
    if (value == "event") return 255;
    if (value == "sync on change") return 0;
    const auto words = words_of(text);
    if (words.size() == 2 && lower(words[0].text) == "sync") {
        const auto every = parse_natural(words[1].text);
        return every && *every >= 1 && *every <= 240 ? every : std::nullopt;
    }
    return parse_natural(value);
}

bool is_on_request(std::uint64_t type) {
    return type == rtr_synchronous || type == rtr_event_driven;
}

std::string name_of(bool to_node, unsigned number) {
    return (to_node ? "rpdo" : "tpdo") + std::to_string(number);
}

}  // namespace

void NodeReader::set_transmission(const PdoWish& wish, const Line& line, Pdo& pdo) {
    const auto type = transmission_of(line.value);
    const bool is_requested = wish.options.contains("request");
    if (type &&
        (*type <= 240 || *type == 254 || *type == 255 || (is_requested && is_on_request(*type)))) {
        pdo.transmission = static_cast<std::uint8_t>(*type);
    } else if (type && is_on_request(*type) && !wish.to_node) {
        report_.error(Topic::node, line.value.at, "this PDO is sent only on request (RTR)",
                      "write tpdo" + std::to_string(wish.number) + ".request = 100ms");
    } else {
        keys_.reject(line, "sync, sync N, sync on change, or event");
    }
}

void NodeReader::set_request(const PdoWish& wish, const Line& line, Pdo& pdo) {
    const auto time = duration(lower(line.value.text));
    if (wish.to_node) {
        report_.error(Topic::value, line.key.at, "only a tpdo can be requested",
                      "the master sends an rpdo by itself");
    } else if (!time || *time < millisecond || *time > 3600 * second) {
        keys_.reject(line, "a time of 1ms..3600s");
    } else {
        pdo.request = *time;
    }
}

std::optional<Time> NodeReader::time_up_to(const Line& line, Time max) {
    const auto time = duration(lower(line.value.text));
    if (time && *time <= max) return time;
    keys_.reject(line, "a time up to " + std::to_string(max / millisecond) + "ms");
    return std::nullopt;
}

void NodeReader::set_inhibit(const PdoWish&, const Line& line, Pdo& pdo) {
    if (const auto time = time_up_to(line, 6553 * millisecond)) {
        pdo.inhibit_100us = static_cast<std::uint16_t>(*time / (100 * microsecond));
    }
}

void NodeReader::set_event_timer(const PdoWish&, const Line& line, Pdo& pdo) {
    if (const auto time = time_up_to(line, 65535 * millisecond)) {
        pdo.event_ms = static_cast<std::uint16_t>(*time / millisecond);
    }
}

void NodeReader::set_timeout(const PdoWish& wish, const Line& line, Pdo& pdo) {
    const auto time = time_up_to(line, 65535 * millisecond);
    if (!time) return;
    if (wish.to_node) {
        report_.error(Topic::value, line.key.at, "only a tpdo has a timeout",
                      "the node can supervise an rpdo: write event-timer");
    } else {
        pdo.limit = *time;
    }
}

void NodeReader::set_cob_id(const PdoWish&, const Line& line, Pdo& pdo) {
    const std::string value = lower(line.value.text);
    const bool is_relative = value.starts_with("$nodeid+");
    const auto number = parse_natural(is_relative ? value.substr(8) : value);
    const std::uint64_t cob = number.value_or(0) + (is_relative ? node_.setup.id : 0);
    const bool is_extended = cob > 0x7ff;
    if (!number || cob == 0 || cob > 0x1fffffff) {
        keys_.reject(line, "an identifier such as 0x1C1, or $NODEID+0x180");
    } else if (!is_extended &&
               (restricted(static_cast<std::uint32_t>(cob)) || cob == cob_id(bus_.sync_cob))) {
        report_.error(
            Topic::value, line.value.at,
            "identifier '" + line.value.text + "' is reserved for another CANopen service",
            "use 0x181..0x57F");
    } else {
        pdo.cob = static_cast<std::uint32_t>(cob) | (is_extended ? cob_extended : 0);
    }
}

void NodeReader::set_sync_start(const PdoWish&, const Line& line, Pdo& pdo) {
    const auto number = parse_natural(lower(line.value.text));
    if (!number || *number > 240) {
        keys_.reject(line, "a number of 0..240");
    } else if (bus_.sync_counter == 0 && *number != 0) {
        report_.error(Topic::node, line.value.at, "sync-start needs a SYNC counter",
                      "write sync-counter = N in [bus]");
    } else {
        pdo.sync_start = static_cast<std::uint8_t>(*number);
    }
}

const std::vector<NodeReader::PdoOption>& NodeReader::pdo_option_rows() {
    static const std::vector<PdoOption> rows{
        {"transmission", &NodeReader::set_transmission}, {"inhibit", &NodeReader::set_inhibit},
        {"event-timer", &NodeReader::set_event_timer},   {"timeout", &NodeReader::set_timeout},
        {"request", &NodeReader::set_request},           {"cob-id", &NodeReader::set_cob_id},
        {"sync-start", &NodeReader::set_sync_start},
    };
    return rows;
}

void NodeReader::pdo_options(const PdoWish& wish, Pdo& pdo) {
    const auto& rows = pdo_option_rows();
    if (wish.options.contains("request")) {
        pdo.transmission = rtr_event_driven;
    }
    for (const auto& [name, line] : wish.options) {
        const auto row = std::find_if(rows.begin(), rows.end(),
                                      [&](const PdoOption& one) { return one.name == name; });
        if (row != rows.end()) {
            (this->*row->apply)(wish, *line, pdo);
            continue;
        }
        std::vector<std::string> names;
        for (const PdoOption& one : rows) {
            names.emplace_back(one.name);
        }
        report_.error(Topic::line, line->key.at, "unknown PDO option '" + name + "'",
                      suggestion(name, names, "the options are"));
    }
    if (pdo.synchronous() && bus_.sync == SyncMode::none) {
        const std::string which = name_of(wish.to_node, wish.number);
        report_.error(Topic::node, pdo.at, which + " is synchronous, but the bus has no SYNC",
                      "write sync = cycle in [bus], or " + which + ".transmission = event");
    }
}

void NodeReader::objects_of(const Word& list, Pdo& pdo) {
    for (const Word& word : list_of(list)) {
        Object out;
        if (object(word, pdo, out)) {
            pdo.objects.push_back(std::move(out));
        }
        if (pdo.objects.size() > 64 && !pdo.multiplexed()) return;
    }
}

bool NodeReader::default_objects(const PdoWish& wish, Pdo& pdo) {
    const auto mapping =
        static_cast<std::uint16_t>((wish.to_node ? 0x1600U : 0x1A00U) + wish.number - 1);
    const auto count = catalog_->number(mapping, 0, 0);
    const Span at = wish.objects != nullptr ? wish.objects->value.at : node_.at;
    const std::string which = name_of(wish.to_node, wish.number);
    if (count == 0xfe || count == 0xff) {
        const std::string sentence =
            which + " is a multiplexed PDO: the device description does not list its objects";
        const std::string help = "name them: " + which + " = mpdo OBJECT, OBJECT";
        if (wish.objects != nullptr) {
            report_.error(Topic::object, at, sentence, help);
        } else {
            report_.note(Topic::object, at, sentence + "; left unchanged", help);
        }
        return false;
    }
    if (count == 0 || count > 64) {
        report_.error(Topic::object, at, "the device description maps no objects to " + which,
                      "name them: " + which + " = OBJECT, OBJECT");
        return false;
    }
    for (unsigned n = 1; n <= count; ++n) {
        const auto entry =
            static_cast<std::uint32_t>(catalog_->number(mapping, static_cast<std::uint8_t>(n), 0));
        const auto index = static_cast<std::uint16_t>(entry >> 16);
        const unsigned bits = entry & 0xff;
        if (entry == 0) continue;
        const Known* known = catalog_->find(index, static_cast<std::uint8_t>(entry >> 8));
        Known unknown;
        unknown.index = index;
        unknown.sub = static_cast<std::uint8_t>(entry >> 8);

        unknown.single = false;
        unknown.name = dashed(object_label(index, unknown.sub));

        unknown.about = object_label(index, unknown.sub);
        if (bits > 32) {
            unknown.type = Type::unsigned64;
        } else if (bits > 16) {
            unknown.type = Type::unsigned32;
        } else if (bits > 8) {
            unknown.type = Type::unsigned16;
        } else {
            unknown.type = Type::unsigned8;
        }
        Object out =
            known_object(known != nullptr && known->type != Type::none ? *known : unknown, bits);
        out.filler = index <= 0x1b;
        pdo.objects.push_back(std::move(out));
    }
    return !pdo.objects.empty();
}

Object NodeReader::known_object(const Known& known, unsigned bits) const {
    Object out;
    out.index = known.index;
    out.sub = known.sub;
    out.type = known.type;
    out.bits = static_cast<std::uint8_t>(bits);
    out.pin = known.name;
    out.about = known.about;
    return out;
}

bool NodeReader::object(const Word& word, Pdo& pdo, Object& out) {
    const auto words = words_of(word);
    const auto reject = [&](std::string sentence, std::string help, std::string label = {}) {
        report_.error(Topic::object, word.at, std::move(sentence), std::move(help),
                      std::move(label));
        return false;
    };
    if (words.empty()) return reject("missing object between commas", "write OBJECT, OBJECT");
    const std::string first = lower(words[0].text);
    if (first == "gap") {
        const auto bits = words.size() == 2 ? parse_natural(words[1].text) : std::nullopt;
        const Type type = !bits         ? Type::none
                          : *bits == 1  ? Type::boolean
                          : *bits == 8  ? Type::unsigned8
                          : *bits == 16 ? Type::unsigned16
                          : *bits == 32 ? Type::unsigned32
                                        : Type::none;
        if (type == Type::none || !pdo.to_node) {
            return reject("invalid gap '" + word.text + "'",
                          "an rpdo can have gap 1, gap 8, gap 16 or gap 32");
        }
        out.index = static_cast<std::uint16_t>(type);
        out.bits = static_cast<std::uint8_t>(*bits);

        out.type = type;
        out.filler = true;
        return true;
    }
    bool has_sub = false;
    const auto place = address(first, has_sub);
    const Known* known =
        place ? catalog_->find(place->first, place->second) : catalog_->find(first);
    if (place && !has_sub && (known == nullptr || !known->single) && catalog_->has(place->first)) {
        return reject("object " + object_label(place->first, 0, true) + " has sub-indices",
                      "write " + object_label(place->first, 1));
    }
    const auto type = words.size() == 2 ? type_named(words[1].text) : std::nullopt;
    if (words.size() > 2 || (words.size() == 2 && !type)) {
        return reject(
            "invalid object '" + word.text + "'",
            std::string("write NAME, or INDEX:SUB TYPE with one of the types ") + type_words);
    }
    if (known == nullptr) {
        if (undescribed_ && !(place && type)) return false;
        if (!place && catalog_->empty()) {
            return reject("this node has no device description",
                          "write eds = FILE, or device = " + listed(Catalog::profiles()));
        }
        if (!place) {
            const std::string near = did_you_mean(first, catalog_->names(pdo.to_node));
            return reject(
                "unknown object '" + words[0].text + "'",
                near.empty() ? "a PDO can carry " + listed(catalog_->names(pdo.to_node), 6) : near);
        }
        if (!type) {
            return reject(
                "the device description has no object " + object_label(place->first, place->second),
                "state its type: " + words[0].text + " u16");
        }
        Known unknown;
        unknown.index = place->first;
        unknown.sub = place->second;
        unknown.name = dashed(words[0].text);
        unknown.about = words[0].text;
        unknown.type = *type;
        out = known_object(unknown, bits_of(*type));
        return bits_of(*type) != 0 || reject("objects of this type have no fixed length",
                                             std::string("write ") + type_words);
    }
    if (pdo.to_node ? !known->to_node : !known->from_node) {
        return reject("object '" + known->name + "' cannot be mapped to " +
                          (pdo.to_node ? "an rpdo" : "a tpdo"),
                      pdo.to_node && known->from_node ? "the node sends it: map it to a tpdo"
                      : !pdo.to_node && known->to_node
                          ? "the node receives it: map it to an rpdo"
                          : "the device description does not allow it in a PDO");
    }
    const Type as = type.value_or(known->type);
    if (bits_of(as) == 0) {
        return reject("object '" + known->name + "' has no fixed length", "a PDO carries numbers");
    }
    out = known_object(*known, bits_of(as));
    out.type = as;
    return true;
}

/// Writes the scanner list: the objects that a node sends in multiplexed PDOs. A node without the
/// list, or with a fixed one, is left as it is.
void NodeReader::scanner_list() {
    constexpr unsigned rows = 254;  // of one object
    unsigned count = 0;
    for (const Pdo& pdo : node_.pdos) {
        if (pdo.multiplex != Multiplex::source_address) continue;
        for (const Object& o : pdo.objects) {
            const auto list = static_cast<std::uint16_t>(0x1fa0 + count / rows);
            const auto row = static_cast<std::uint8_t>(count++ % rows + 1);
            const Known* known = catalog_->find(list, row);
            if (known != nullptr ? !known->writable : catalog_->has(list)) continue;
            node_.setup.writes.push_back(object_write(
                list, row, 1U << 24 | std::uint32_t{o.index} << 8 | o.sub, "Object scanner list"));
            node_.setup.writes.back().optional = true;
        }
    }
}

void NodeReader::configure(Pdo& pdo) {
    if (pdo.cob == 0) {
        return;  // assigned when all nodes are known
    }
    configure_pdo(node_.setup, pdo);
}

void configure_pdo(NodeSetup& node, const Pdo& pdo) {
    PdoDescription d;
    d.cob = pdo.cob;
    d.transmission = pdo.transmission;
    d.multiplex = pdo.multiplex;
    if (!pdo.to_node) {
        d.inhibit_100us = pdo.inhibit_100us;
        d.sync_start = pdo.sync_start;
    }
    // The event timer of an RPDO is the node's timeout: three missing messages in a row.
    d.event_ms = static_cast<std::uint16_t>(
        std::min(pdo.to_node ? 3U * pdo.event_ms : pdo.event_ms, 65535U));
    if (!pdo.multiplexed()) {
        for (const Object& o : pdo.objects) {
            d.mapping.push_back(map_entry(o.index, o.sub, o.bits));
        }
    }
    auto writes =
        pdo.to_node ? rpdo_writes(pdo.number, d, node.id) : tpdo_writes(pdo.number, d, node.id);
    std::move(writes.begin(), writes.end(), std::back_inserter(node.writes));
}

}  // namespace hal::canopen::config
