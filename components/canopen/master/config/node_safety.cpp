// SPDX-License-Identifier: MIT
#include "node_safety.hpp"

#include <algorithm>
#include <iterator>

#include "canopen/master/boot/srdo_writes.hpp"

namespace hal::canopen::config {

namespace {

std::string name_of(const Pdo& pdo) {
    return (pdo.to_node ? "rsrdo" : "tsrdo") + std::to_string(pdo.number);
}

/// What the options of an SRDO are read into.
struct SrdoTarget {
    Pdo& pdo;
};

/// A time in whole milliseconds.
auto milliseconds(Time Safety::* member, Time max) {
    const std::string range = "up to " + std::to_string(max / millisecond) + "ms";
    return bus::own("whole milliseconds " + range, "1ms.." + bus::time_text(max),
                    [member, max](SrdoTarget& to, const Line& line) {
        const auto time = duration(line.value.text);
        if (!time || *time < millisecond || *time > max || *time % millisecond != 0) return false;
        (*to.pdo.safety).*member = *time;
        return true;
    });
}

bool read_cob_id(SrdoTarget& to, const Line& line) {
    const auto id = parse_natural(line.value.text);
    if (!id || *id < 0x101 || *id > 0x17f || *id % 2 == 0) return false;
    to.pdo.cob = static_cast<std::uint32_t>(*id);
    return true;
}

const bus::KeyTable<SrdoTarget>& option_keys() {
    static const bus::KeyTable<SrdoTarget> table{{
        {"refresh", milliseconds(&Safety::refresh, 65535 * millisecond), "half the SCT",
         "refresh time: transmission period"},
        {"sct", milliseconds(&Safety::sct, 65535 * millisecond), "`50ms`",
         "safeguard cycle time: without a valid SRDO for this time the receiver enters the safe "
         "state"},
        {"srvt", milliseconds(&Safety::srvt, 255 * millisecond), "`20ms`",
         "safety-related validation time: maximum interval between its two frames"},
        {"cob-id",
         bus::own("an odd identifier of 0x101..0x17F; the second frame has the next one",
                  "odd, 0x101..0x17F", &read_cob_id),
         "FFh + 2 · ID for SRDO 1 of node IDs 1..64; otherwise required",
         "COB-ID of the first frame; the second frame has the next one"},
    }};
    return table;
}

}  // namespace

std::string srdo_reference() { return option_keys().reference("tsrdo1."); }

void NodeSrdos::read() {
    const PdoRequests requests = requests_of(in_, "srdo", Srdos::max_srdos);
    for (const auto& [key, request] : requests) {
        if (!key.first || !requests.contains({false, key.second})) {
            srdo(request);
            continue;
        }
        const Line& line =
            request.objects != nullptr ? *request.objects : *request.options.begin()->second;
        const std::string number = std::to_string(key.second);
        report_.error(Topic::node, line.key.at,
                      "SRDO " + number + " of a node is either sent or received, not both",
                      "renumber one of them: rsrdo" + std::to_string(key.second + 1));
    }
}

void NodeSrdos::srdo(const PdoRequest& request) {
    Pdo pdo;
    pdo.to_node = request.to_node;
    pdo.number = request.number;
    pdo.safety.emplace();
    if (request.objects == nullptr) {
        const Line& line = *request.options.begin()->second;
        return report_.error(
            Topic::node, line.key.at, name_of(pdo) + " has options but no objects",
            "name its objects: " + name_of(pdo) + " = OBJECT / INVERTED, OBJECT / INVERTED");
    }
    pdo.at = request.objects->value.at;
    for (const Word& word : list_of(request.objects->value)) {
        read_pair(word, pdo);
        if (pdo.objects.size() > 64) return;
    }
    options(request, pdo);
    if (pdo.bits() > 64) {
        report_.error(
            Topic::object, pdo.at,
            "these objects have " + std::to_string(pdo.bits()) + " bits; an SRDO carries 64",
            "move some to another SRDO");
    } else if (!pdo.objects.empty()) {
        node_.pdos.push_back(std::move(pdo));
    }
}

/// Reads OBJECT / INVERTED.
void NodeSrdos::read_pair(const Word& word, Pdo& pdo) {
    const auto pair = list_of(word, '/');
    if (pair.size() != 2) {
        return report_.error(
            Topic::object, word.at,
            "invalid pair '" + word.text + "': expected an object and its inverted object",
            "write OBJECT / INVERTED, as in 0x2300:1 / 0x2301:1");
    }
    const ObjectReader objects = in_.objects();
    Object plain;
    Object inverted;
    if (!objects.read(pair[0], pdo.to_node, plain) ||
        !objects.read(pair[1], pdo.to_node, inverted)) {
        return;
    }
    if (plain.bits != inverted.bits || plain.filler || inverted.filler || plain.same(inverted)) {
        report_.error(
            Topic::object, word.at,
            "'" + pair[1].text + "' cannot hold '" + pair[0].text + "' inverted",
            plain.same(inverted) ? "both are the same object" : "both must have the same length");
    }
    pdo.safety->inverted.push_back(map_entry(inverted.index, inverted.sub, inverted.bits));
    pdo.objects.push_back(std::move(plain));
}

void NodeSrdos::options(const PdoRequest& request, Pdo& pdo) {
    SrdoTarget target{pdo};
    bus::TopicReport<Topic> key_report(report_);
    option_keys().apply(request, target, key_report);
    for (const auto& [name, line] : request.options) {
        if (option_keys().find(name) != nullptr) continue;
        report_.error(Topic::line, line->key.at, "unknown SRDO option '" + name + "'",
                      suggestion(name, option_keys().names(), "the options are"));
    }
    Safety& s = *pdo.safety;
    if (request.find("refresh") == nullptr) {
        s.refresh = std::max<Time>(s.sct / 2 / millisecond * millisecond, millisecond);
    }
    if (s.refresh >= s.sct) {
        report_.error(Topic::node, pdo.at,
                      name_of(pdo) + " always times out: it is sent every " +
                          std::to_string(s.refresh / millisecond) + "ms, its timeout is " +
                          std::to_string(s.sct / millisecond) + "ms",
                      "write " + name_of(pdo) + ".sct = " +
                          std::to_string(2 * s.refresh / millisecond) + "ms, or a shorter refresh");
    }
    if (pdo.cob == 0 && pdo.number == 1 && node_.setup.id <= 64) {
        pdo.cob = 0xffU + 2U * node_.setup.id;
    }
}

/// Reports objects of an SRDO that another PDO or SRDO maps as well.
void NodeSrdos::check_shared(const Pdo& pdo) {
    for (const Pdo& other : node_.pdos) {
        if (&other == &pdo) continue;
        for (const Object& o : pdo.objects) {
            const auto& objects = other.objects;
            const bool is_shared = std::any_of(objects.begin(), objects.end(),
                                               [&](const Object& b) { return o.same(b); });
            if (!is_shared) continue;
            report_.error(Topic::node, pdo.at,
                          "object " + object_text(o.index, o.sub) + " of " + name_of(pdo) +
                              " is also in another PDO or SRDO",
                          "map a safety-related object to one SRDO only");
        }
    }
}

void NodeSrdos::configure() {
    std::vector<ObjectWrite> all;
    for (const Pdo& pdo : node_.pdos) {
        if (!pdo.safety) continue;
        check_shared(pdo);
        if (pdo.cob == 0) {
            report_.error(
                Topic::node, pdo.at, name_of(pdo) + " has no default identifier",
                "assign a free odd one of 0x101..0x17F: " + name_of(pdo) + ".cob-id = 0x151");
            continue;
        }
        auto writes = srdo_writes(pdo.number, node_srdo(pdo));
        std::move(writes.begin(), writes.end(), std::back_inserter(all));
    }
    if (all.empty()) return;
    std::move(all.begin(), all.end(), std::back_inserter(node_.setup.writes));
    node_.setup.writes.push_back(srdo_valid_write());
}

SrdoDescription node_srdo(const Pdo& pdo) {
    SrdoDescription d;
    d.direction = pdo.to_node ? SrdoDirection::receives : SrdoDirection::sends;
    d.cycle_ms = static_cast<std::uint16_t>((pdo.to_node ? pdo.safety->sct : pdo.safety->refresh) /
                                            millisecond);
    d.validation_ms = static_cast<std::uint8_t>(pdo.safety->srvt / millisecond);
    d.cob = pdo.cob;
    for (std::size_t n = 0; n < pdo.objects.size(); ++n) {
        const Object& o = pdo.objects[n];
        d.mapping.push_back(map_entry(o.index, o.sub, o.bits));
        d.mapping.push_back(pdo.safety->inverted[n]);
    }
    return d;
}

}  // namespace hal::canopen::config
