// SPDX-License-Identifier: MIT
#include "node_pdos.hpp"

#include <algorithm>

#include "text/characters.hpp"

namespace hal::canopen::config {

namespace {

constexpr unsigned max_pdos = 512;

std::string upper(std::string text) {
    std::ranges::transform(text, text.begin(), [](char c) { return hal::upper(c); });
    return text;
}

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

/// What the options of a PDO are read into.
struct PdoTarget {
    const NodeInput& in;
    const PdoRequest& request;
    Pdo& pdo;
    Keys& keys() const { return in.keys; }
    void error(Topic topic, Span at, std::string sentence, std::string help) const {
        in.report.error(topic, at, std::move(sentence), std::move(help));
    }
};

template <class T>
auto of_pdo(T Pdo::* member) {
    return [member](PdoTarget& to) -> T& { return to.pdo.*member; };
}

bool read_transmission(PdoTarget& to, const Line& line) {
    const auto type = transmission_of(line.value);
    if (!type) return false;
    const bool is_plain = *type <= 240 || *type == 254 || *type == 255;
    if (is_plain || (is_on_request(*type) && to.request.find("request") != nullptr)) {
        to.pdo.transmission = static_cast<std::uint8_t>(*type);
        return true;
    }
    if (!is_on_request(*type) || to.request.to_node) return false;
    to.error(Topic::node, line.value.at, "this PDO is sent only on request (RTR)",
             "write " + pdo_name(false, to.request.number) + ".request = 100ms");
    return true;
}

bool read_request(PdoTarget& to, const Line& line) {
    if (to.request.to_node) {
        to.error(Topic::value, line.key.at, "only a tpdo can be requested",
                 "the master sends an rpdo by itself");
        return true;
    }
    return bus::time(of_pdo(&Pdo::request), millisecond, 3600 * second).parse(to, line);
}

bool read_timeout(PdoTarget& to, const Line& line) {
    if (to.request.to_node) {
        to.error(Topic::value, line.key.at, "only a tpdo has a timeout",
                 "the node can supervise an rpdo: write event-timer");
        return true;
    }
    return bus::time(of_pdo(&Pdo::limit), 0, 65535 * millisecond).or_none().parse(to, line);
}

/// Reads an identifier, or one relative to the node ID: $NODEID+0x180.
bool read_cob_id(PdoTarget& to, const Line& line) {
    const std::string value = lower(line.value.text);
    const bool is_relative = value.starts_with("$nodeid+");
    const auto number = parse_natural(is_relative ? value.substr(8) : value);
    const std::uint64_t cob =
        number.value_or(0) + (is_relative ? std::uint64_t{to.in.node.setup.id} : 0);
    if (!number || cob == 0 || cob > 0x1fffffff) return false;
    const bool is_extended = cob > 0x7ff;
    const auto id = static_cast<std::uint32_t>(cob);
    if (!is_extended && (restricted(id) || id == cob_id(to.in.bus.sync_cob))) {
        to.error(Topic::value, line.value.at,
                 "identifier '" + line.value.text + "' is reserved for another CANopen service",
                 "use 0x181..0x57F");
        return true;
    }
    to.pdo.cob = id | (is_extended ? cob_extended : 0);
    return true;
}

bool read_sync_start(PdoTarget& to, const Line& line) {
    if (!bus::number(of_pdo(&Pdo::sync_start), 0, 240).parse(to, line)) return false;
    if (to.in.bus.sync_counter == 0 && to.pdo.sync_start != 0) {
        to.error(Topic::node, line.value.at, "sync-start needs a SYNC counter",
                 "write sync-counter = N in [bus]");
    }
    return true;
}

const bus::KeyTable<PdoTarget>& option_keys() {
    static const bus::KeyTable<PdoTarget> table{{
        {"transmission",
         bus::own("sync, sync N, sync on change, or event",
                  "sync, sync N, sync on change, event, 0..255", &read_transmission),
         "`sync` if the bus has a SYNC, else `event`; with `default` that of the description",
         "transmission type; `sync N`: every N-th SYNC; or the number of CiA 301"},
        {"cob-id",
         bus::own("an identifier such as 0x1C1, or $NODEID+0x180", "an identifier, $NODEID+0x180",
                  &read_cob_id),
         "that of the predefined connection set for PDO 1–4, else a free one", "COB-ID"},
        {"inhibit",
         bus::time(of_pdo(&Pdo::inhibit_100us), 0, 6553 * millisecond).in(100 * microsecond),
         "none", "inhibit time: minimum interval between two transmissions"},
        {"event-timer", bus::time(of_pdo(&Pdo::event_ms), 0, 65535 * millisecond).in(millisecond),
         "none",
         "event timer: maximum interval between two transmissions. The timeout of an rpdo in the "
         "node is three times its event timer"},
        {"timeout",
         bus::own("a time of 0..65535ms, as in 10ms or 0.5s, or none", "0..65535ms, none",
                  &read_timeout),
         "10 of its SYNC periods, 3 of its `event-timer` or `request`, at least 20 ms; none if it "
         "is sent on change or event only",
         "of a tpdo: reception timeout in the master. Its expiry is a fault, and the node is not "
         "`operational` until the next one"},
        {"request",
         bus::own("a time of 1ms..3600s, as in 10ms or 0.5s", "1ms..3600s", &read_request), "none",
         "of a tpdo: period at which the master requests the PDO with a remote frame; "
         "`transmission` is then 253, or 252 for the value sampled at the last SYNC"},
        {"sync-start", bus::own("a number of 0..240", "0..240", &read_sync_start), "`0`",
         "SYNC counter value at which the transmission starts"},
    }};
    return table;
}

}  // namespace

std::string pdo_reference() { return option_keys().reference("tpdo1."); }

std::string pdo_name(bool to_node, unsigned number) {
    return (to_node ? "rpdo" : "tpdo") + std::to_string(number);
}

PdoRequests requests_of(const NodeInput& in, const char* what, unsigned max) {
    PdoRequests out;
    for (const bool to_node : {true, false}) {
        const std::string beginning = std::string(to_node ? "r" : "t") + what;
        for (Line* line : in.keys.all_of(beginning)) {
            const std::string rest = line->key.text.substr(beginning.size());
            const std::size_t dot = std::min(rest.find('.'), rest.size());
            const auto number = parse_natural(rest.substr(0, dot));
            if (!number) continue;  // an object whose name begins alike
            line->used = true;
            if (*number < 1 || *number > max) {
                in.report.error(Topic::value, line->key.at,
                                "invalid " + upper(what) + " number " + std::to_string(*number),
                                upper(what) + "s are numbered 1.." + std::to_string(max));
                continue;
            }
            PdoRequest& request = out[{to_node, static_cast<unsigned>(*number)}];
            request.number = static_cast<unsigned>(*number);
            request.to_node = to_node;
            if (dot == rest.size()) {
                request.objects = line;
            } else {
                request.options[rest.substr(dot + 1)] = line;
            }
        }
    }
    return out;
}

std::uint16_t NodePdos::communication(bool to_node, unsigned number) const {
    return static_cast<std::uint16_t>((to_node ? 0x1400U : 0x1800U) + number - 1);
}

/// Returns whether the PDO is valid and maps an object by default.
bool NodePdos::is_enabled(bool to_node, unsigned number) const {
    const std::uint16_t base = communication(to_node, number);
    const auto mapping = static_cast<std::uint16_t>(base + 0x200);
    return (in_.catalog.number(base, 1, cob_invalid) & cob_invalid) == 0 &&
           in_.catalog.number(mapping, 0, 0) != 0;
}

void NodePdos::read() {
    const PdoRequests requests = requests_of(in_, "pdo", max_pdos);
    const bool any_named = std::any_of(requests.begin(), requests.end(), [](const auto& request) {
        return request.second.objects != nullptr;
    });
    for (unsigned number = 1; number <= max_pdos; ++number) {
        for (const bool to_node : {true, false}) {
            const auto at = requests.find({to_node, number});
            read_number(to_node, number, at == requests.end() ? nullptr : &at->second, any_named);
        }
    }
}

void NodePdos::read_number(bool to_node, unsigned number, const PdoRequest* request,
                           bool any_named) {
    const bool by_default = is_enabled(to_node, number) && !any_named;
    if (request == nullptr && by_default) return pdo({number, to_node});
    if (request == nullptr) {
        if (is_enabled(to_node, number)) {
            switch_off(to_node, number);  // a PDO that is not named stays off the bus
        }
        return;
    }
    if (request->objects != nullptr || by_default) return pdo(*request);
    const Line& line = *request->options.begin()->second;
    const std::string name = pdo_name(to_node, number);
    report_.error(Topic::node, line.key.at, name + " has options but no objects",
                  "name its objects: " + name + " = OBJECT, OBJECT, or = default");
}

void NodePdos::switch_off(bool to_node, unsigned number) {
    auto off =
        to_node ? rpdo_writes(number, {}, node_.setup.id) : tpdo_writes(number, {}, node_.setup.id);
    std::move(off.begin(), off.end(), std::back_inserter(node_.setup.writes));
}

void NodePdos::pdo(const PdoRequest& request) {
    Pdo pdo;
    pdo.to_node = request.to_node;
    pdo.number = request.number;
    pdo.at = request.objects != nullptr ? request.objects->value.at : node_.at;
    if (request.objects != nullptr && same_word(request.objects->value.text, "none")) {
        return switch_off(pdo.to_node, pdo.number);
    }
    pdo.transmission = in_.bus.sync != SyncMode::none ? 1 : 255;
    if (!read_objects(request, pdo)) return;
    pdo.cob = default_identifier(pdo);
    options(request, pdo);
    check_multiplexed(request, pdo);
    if (!pdo.multiplexed() && pdo.bits() > 64) {
        report_.error(
            Topic::object, pdo.at,
            "these objects have " + std::to_string(pdo.bits()) + " bits; a PDO carries 64",
            "move some to another PDO");
    } else if (!pdo.objects.empty()) {
        node_.pdos.push_back(std::move(pdo));
    }
}

/// Reads OBJECT, OBJECT; mpdo OBJECT, OBJECT; or default, which is also what no key means.
bool NodePdos::read_objects(const PdoRequest& request, Pdo& pdo) {
    const std::string text =
        request.objects != nullptr ? lower(request.objects->value.text) : "default";
    if (text.starts_with("mpdo ")) {
        multiplexed_objects(request.objects->value, pdo);
        return true;
    }
    if (text != "default") {
        objects_of(request.objects->value, pdo);
        return true;
    }
    if (!default_objects(request, pdo)) return false;
    const std::uint16_t base = communication(pdo.to_node, pdo.number);
    pdo.transmission = static_cast<std::uint8_t>(in_.catalog.number(base, 2, 255));
    pdo.inhibit_100us = static_cast<std::uint16_t>(in_.catalog.number(base, 3, 0));
    pdo.event_ms = static_cast<std::uint16_t>(in_.catalog.number(base, 5, 0));
    return true;
}

void NodePdos::objects_of(const Word& list, Pdo& pdo) {
    for (const Word& word : list_of(list)) {
        Object out;
        if (in_.objects().read(word, pdo.to_node, out)) {
            pdo.objects.push_back(std::move(out));
        }
        if (pdo.objects.size() > 64 && !pdo.multiplexed()) return;
    }
}

void NodePdos::multiplexed_objects(const Word& value, Pdo& pdo) {
    constexpr std::size_t begin = std::string_view("mpdo ").size();
    pdo.multiplex = pdo.to_node ? Multiplex::destination_address : Multiplex::source_address;
    pdo.transmission = 255;
    objects_of(text::part(value, begin, value.text.size()), pdo);
    std::erase_if(pdo.objects, [&](const Object& o) { return !multiplexable(o, pdo); });
}

bool NodePdos::multiplexable(const Object& o, const Pdo& pdo) {
    if (!o.filler && o.bits <= 32 && o.bits % 8 == 0) return true;
    report_.error(Topic::object, pdo.at,
                  o.filler ? std::string("a multiplexed PDO has no gaps")
                           : "object '" + o.pin + "' has " + std::to_string(o.bits) + " bits",
                  "a multiplexed PDO carries one object of 8, 16, 24 or 32 bits at a time");
    return false;
}

/// Returns the identifier of the description, or else of the predefined connection set; 0: neither
/// has one.
std::uint32_t NodePdos::default_identifier(const Pdo& pdo) const {
    const auto described = static_cast<std::uint32_t>(
        in_.catalog.number(communication(pdo.to_node, pdo.number), 1, cob_invalid));
    if ((described & cob_invalid) == 0 && cob_id(described) != 0) {
        return described & (cob_extended | 0x1fffffff);
    }
    if (pdo.number > 4) return 0;
    return (pdo.to_node ? 0x100U : 0x80U) + 0x100 * pdo.number + node_.setup.id;
}

void NodePdos::options(const PdoRequest& request, Pdo& pdo) {
    if (request.find("request") != nullptr) {
        pdo.transmission = rtr_event_driven;
    }
    PdoTarget target{in_, request, pdo};
    bus::TopicReport<Topic> key_report(report_);
    option_keys().apply(request, target, key_report);
    for (const auto& [name, line] : request.options) {
        if (option_keys().find(name) != nullptr) continue;
        report_.error(Topic::line, line->key.at, "unknown PDO option '" + name + "'",
                      suggestion(name, option_keys().names(), "the options are"));
    }
    if (pdo.synchronous() && in_.bus.sync == SyncMode::none) {
        const std::string which = pdo_name(request.to_node, request.number);
        report_.error(Topic::node, pdo.at, which + " is synchronous, but the bus has no SYNC",
                      "write sync = cycle in [bus], or " + which + ".transmission = event");
    }
}

void NodePdos::check_multiplexed(const PdoRequest& request, const Pdo& pdo) {
    if (!pdo.multiplexed() || pdo.transmission >= 254) return;
    for (const char* key : {"transmission", "request"}) {
        if (const Line* given = request.find(key)) {
            report_.error(Topic::node, given->value.at,
                          "a multiplexed PDO is sent when an object changes",
                          "write transmission = event, or delete the line");
        }
    }
}

bool NodePdos::is_multiplexed_by_default(const PdoRequest& request, std::uint64_t count) {
    if (count != 0xfe && count != 0xff) return false;
    const Span at = request.objects != nullptr ? request.objects->value.at : node_.at;
    const std::string which = pdo_name(request.to_node, request.number);
    const std::string sentence =
        which + " is a multiplexed PDO: the device description does not list its objects";
    const std::string help = "name them: " + which + " = mpdo OBJECT, OBJECT";
    if (request.objects != nullptr) {
        report_.error(Topic::object, at, sentence, help);
    } else {
        report_.note(Topic::object, at, sentence + "; left unchanged", help);
    }
    return true;
}

bool NodePdos::default_objects(const PdoRequest& request, Pdo& pdo) {
    const auto mapping =
        static_cast<std::uint16_t>(communication(request.to_node, request.number) + 0x200);
    const auto count = in_.catalog.number(mapping, 0, 0);
    if (is_multiplexed_by_default(request, count)) return false;
    if (count == 0 || count > 64) {
        const Span at = request.objects != nullptr ? request.objects->value.at : node_.at;
        const std::string which = pdo_name(request.to_node, request.number);
        report_.error(Topic::object, at, "the device description maps no objects to " + which,
                      "name them: " + which + " = OBJECT, OBJECT");
        return false;
    }
    for (unsigned n = 1; n <= count; ++n) {
        const auto entry = static_cast<std::uint32_t>(
            in_.catalog.number(mapping, static_cast<std::uint8_t>(n), 0));
        if (entry != 0) {
            pdo.objects.push_back(default_object(entry));
        }
    }
    return !pdo.objects.empty();
}

namespace {

Type unsigned_type(unsigned bits) {
    if (bits > 32) return Type::unsigned64;
    if (bits > 16) return Type::unsigned32;
    if (bits > 8) return Type::unsigned16;
    return Type::unsigned8;
}

}  // namespace

Object NodePdos::default_object(std::uint32_t entry) const {
    const auto index = static_cast<std::uint16_t>(entry >> 16);
    const auto sub = static_cast<std::uint8_t>(entry >> 8);
    const unsigned bits = entry & 0xff;
    const Known* known = in_.catalog.find(index, sub);
    Known unknown;
    if (known == nullptr || known->type == Type::none) {
        unknown.index = index;
        unknown.sub = sub;
        unknown.single = false;
        unknown.about = object_text(index, sub);
        unknown.name = dashed(unknown.about);
        unknown.type = unsigned_type(bits);
        known = &unknown;
    }
    Object out = mapped_object(*known, bits);
    out.filler = index <= 0x1b;
    return out;
}

/// Writes the scanner list: the objects that a node sends in multiplexed PDOs. A node without the
/// list, or with a fixed one, is left as it is.
void NodePdos::scanner_list() {
    constexpr unsigned rows = 254;  // of one object
    unsigned count = 0;
    for (const Pdo& pdo : node_.pdos) {
        if (pdo.multiplex != Multiplex::source_address) continue;
        for (const Object& o : pdo.objects) {
            const auto list = static_cast<std::uint16_t>(0x1fa0 + count / rows);
            const auto row = static_cast<std::uint8_t>(count++ % rows + 1);
            const Known* known = in_.catalog.find(list, row);
            if (known != nullptr ? !known->writable : in_.catalog.has(list)) continue;
            node_.setup.writes.push_back(object_write(
                list, row, 1U << 24 | std::uint32_t{o.index} << 8 | o.sub, "Object scanner list"));
            node_.setup.writes.back().optional = true;
        }
    }
}

void NodePdos::configure() {
    scanner_list();
    for (const Pdo& pdo : node_.pdos) {
        // without an identifier, it is assigned when all nodes are known
        if (!pdo.safety && pdo.cob != 0) {
            configure_pdo(node_.setup, pdo);
        }
    }
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
