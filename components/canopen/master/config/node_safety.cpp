// SPDX-License-Identifier: MIT
// The SRDOs of a node (EN 50325-5): tsrdoN and rsrdoN, each object with the one that holds it
// inverted.
#include <algorithm>
#include <iterator>

#include "canopen/master/boot/srdo_writes.hpp"
#include "canopen/protocol/srdo_description.hpp"
#include "node_reader.hpp"

namespace hal::canopen::config {

namespace {

std::string name_of(const Pdo& pdo) {
    return (pdo.to_node ? "rsrdo" : "tsrdo") + std::to_string(pdo.number);
}

}  // namespace

void NodeReader::srdos() {
    const auto wished = wishes("srdo", Srdos::max_srdos);
    for (const auto& [key, wish] : wished) {
        if (key.first && wished.contains({false, key.second})) {
            const Line& line =
                wish.objects != nullptr ? *wish.objects : *wish.options.begin()->second;
            const std::string number = std::to_string(key.second);
            report_.error(Topic::node, line.key.at,
                          "SRDO " + number + " of a node is either sent or received, not both",
                          "renumber one of them: rsrdo" + std::to_string(key.second + 1));
        } else {
            srdo(wish);
        }
    }
}

void NodeReader::srdo(const PdoWish& wish) {
    Pdo pdo;
    pdo.to_node = wish.to_node;
    pdo.number = wish.number;
    pdo.safety.emplace();
    if (wish.objects == nullptr) {
        const Line& line = *wish.options.begin()->second;
        return report_.error(
            Topic::node, line.key.at, name_of(pdo) + " has options but no objects",
            "name its objects: " + name_of(pdo) + " = OBJECT / INVERTED, OBJECT / INVERTED");
    }
    pdo.at = wish.objects->value.at;
    for (const Word& word : list_of(wish.objects->value)) {
        const auto pair = list_of(word, '/');
        Object plain, inverted;
        if (pair.size() != 2) {
            report_.error(
                Topic::object, word.at,
                "invalid pair '" + word.text + "': expected an object and its inverted object",
                "write OBJECT / INVERTED, as in 0x2300:1 / 0x2301:1");
            continue;
        }
        if (!object(pair[0], pdo, plain) || !object(pair[1], pdo, inverted)) continue;
        if (plain.bits != inverted.bits || plain.filler || inverted.filler ||
            plain.same(inverted)) {
            report_.error(Topic::object, word.at,
                          "'" + pair[1].text + "' cannot hold '" + pair[0].text + "' inverted",
                          plain.same(inverted) ? "both are the same object"
                                               : "both must have the same length");
        }
        pdo.safety->inverted.push_back(map_entry(inverted.index, inverted.sub, inverted.bits));
        pdo.objects.push_back(std::move(plain));
        if (pdo.objects.size() > 64) return;
    }
    srdo_options(wish, pdo);
    if (pdo.bits() > 64) {
        report_.error(
            Topic::object, pdo.at,
            "these objects have " + std::to_string(pdo.bits()) + " bits; an SRDO carries 64",
            "move some to another SRDO");
    } else if (!pdo.objects.empty()) {
        node_.pdos.push_back(std::move(pdo));
    }
}

namespace {

Time& time_option(Safety& safety, const std::string& name) {
    if (name == "srvt") return safety.srvt;
    if (name == "sct") return safety.sct;
    return safety.refresh;
}

}  // namespace

void NodeReader::srdo_options(const PdoWish& wish, Pdo& pdo) {
    Safety& s = *pdo.safety;
    bool refresh_given = false;
    for (const auto& [name, line] : wish.options) {
        const bool srvt = name == "srvt";
        if (srvt || name == "sct" || name == "refresh") {
            const auto time = duration(line->value.text);
            const Time most = (srvt ? 255 : 65535) * millisecond;
            if (!time || *time < millisecond || *time > most || *time % millisecond != 0) {
                keys_.reject(
                    *line, "whole milliseconds up to " + std::to_string(most / millisecond) + "ms");
            } else {
                Time& option = time_option(s, name);
                option = *time;
            }
            refresh_given = refresh_given || name == "refresh";
        } else if (name == "cob-id") {
            const auto id = parse_natural(line->value.text);
            if (!id || *id < 0x101 || *id > 0x17f || *id % 2 == 0) {
                keys_.reject(
                    *line, "an odd identifier of 0x101..0x17F; the second frame has the next one");
            } else {
                pdo.cob = static_cast<std::uint32_t>(*id);
            }
        } else {
            report_.error(Topic::line, line->key.at, "unknown SRDO option '" + name + "'",
                          "the options are refresh, sct, srvt, cob-id");
        }
    }
    if (!refresh_given) {
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

void NodeReader::configure_srdos() {
    std::vector<ObjectWrite> all;
    for (const Pdo& pdo : node_.pdos) {
        if (!pdo.safety) continue;
        for (const Pdo& other : node_.pdos) {
            for (const Object& o : pdo.objects) {
                if (&other != &pdo && std::any_of(other.objects.begin(), other.objects.end(),
                                                  [&](const Object& b) { return o.same(b); })) {
                    report_.error(Topic::node, pdo.at,
                                  "object " + object_label(o.index, o.sub) + " of " + name_of(pdo) +
                                      " is also in another PDO or SRDO",
                                  "map a safety-related object to one SRDO only");
                }
            }
        }
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
