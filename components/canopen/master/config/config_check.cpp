// SPDX-License-Identifier: MIT
// The checks over all nodes of a network, and what depends on all of them.
#include <algorithm>
#include <map>
#include <set>

#include "canopen/protocol/srdo_description.hpp"
#include "config_sections.hpp"
#include "node_pdos.hpp"

namespace hal::canopen::config {

namespace {

/// The bits of a PDO that are objects, not gaps.
std::uint64_t used_bits(const Pdo& pdo) {
    std::uint64_t used = 0;
    unsigned bit = 0;
    for (const Object& o : pdo.objects) {
        if (!o.filler && o.bits != 0 && bit + o.bits <= 64) {
            used |= (o.bits == 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << o.bits) - 1) << bit;
        }
        bit += o.bits;
    }
    return used;
}

/// Several nodes may read their parts of the same message of the master. Returns why these two may
/// not, or nothing.
std::string why_not_shared(const Pdo& a, const Pdo& b) {
    if (a.safety || b.safety) return "an SRDO cannot share its identifiers";
    if (!a.to_node || !b.to_node) {
        return "two senders of one identifier destroy each other's frames";
    }
    if (a.multiplexed() || b.multiplexed()) return "a multiplexed PDO cannot share its identifier";
    if (a.bits() != b.bits()) {
        return "nodes that share a message must map the same length; fill up with gap 8, gap 16 or "
               "gap 32";
    }
    if ((used_bits(a) & used_bits(b)) != 0) {
        return "objects of nodes that share a message must not overlap; put gap 16 or gap 32 "
               "before them";
    }
    if (a.transmission != b.transmission) {
        return "nodes that share a message must have the same transmission type";
    }
    return {};
}

}  // namespace

void assign_identifiers(MasterConfig& config, Report& report) {
    std::set<std::uint32_t> taken{cob_id(config.sync_cob)};
    for (const Node& n : config.nodes) {
        for (unsigned k = 0; k < 8; ++k) {
            taken.insert(0x180 + 0x80 * k + n.setup.id);
        }
        for (const Pdo& p : n.pdos) {
            taken.insert(cob_id(p.cob));
        }
    }
    for (const Foreign& f : config.foreign) {
        taken.insert(f.id);
    }
    for (Node& n : config.nodes) {
        for (Pdo& p : n.pdos) {
            if (p.cob != 0 || p.safety) continue;
            for (unsigned base = p.to_node ? 0x200 : 0x180; base < 0x580 && p.cob == 0;
                 base += 0x100) {
                for (unsigned id = base + 1; id < base + 0x80 && p.cob == 0; ++id) {
                    if (!taken.contains(id)) {
                        p.cob = id;
                    }
                }
            }
            if (p.cob == 0) {
                report.error(Topic::node, p.at, "no free 11-bit identifier for this PDO",
                             "assign an extended one: " + std::string(p.to_node ? "rpdo" : "tpdo") +
                                 std::to_string(p.number) + ".cob-id = 0x10000000");
            }
            taken.insert(p.cob);
            configure_pdo(n.setup, p);
        }
    }
}

void date_by_content(NodeSetup& node) {
    std::uint64_t sum = 0xcbf29ce484222325;  // FNV-1a
    const auto add = [&](unsigned byte) { sum = (sum ^ byte) * 0x100000001b3; };
    for (const ObjectWrite& w : node.writes) {
        add(w.index & 0xff);
        add(w.index >> 8U);
        add(w.sub);
        add(w.data.size() & 0xff);
        for (const std::uint8_t byte : w.data) {
            add(byte);
        }
    }
    constexpr std::uint64_t days = 49'000;
    constexpr std::uint64_t day_ms = 86'400'000;
    node.configuration_date = static_cast<std::uint32_t>(1 + sum % days);
    node.configuration_time = static_cast<std::uint32_t>((sum >> 20) % day_ms);
}

void check_network(const MasterConfig& config, Report& report) {
    struct User {
        const Node* node;
        const Pdo* pdo;
    };
    constexpr std::size_t max_multiplexed = 48 * 254;  // rows of 1FD0h to 1FFFh
    std::size_t multiplexed = 0;
    std::multimap<std::uint32_t, User> users;
    unsigned sent = 0;
    unsigned received = 0;
    unsigned safety = 0;
    const auto called = [](const User& u) {
        const std::string direction = u.pdo->to_node ? "r" : "t";
        const std::string kind = u.pdo->safety ? "srdo" : "pdo";
        return direction + kind + std::to_string(u.pdo->number) + " of '" + u.node->name + "'";
    };
    for (const Node& n : config.nodes) {
        for (const Pdo& p : n.pdos) {
            const std::uint32_t cob = p.cob & (cob_extended | 0x1fffffff);
            if (p.multiplexed() && !p.to_node) {
                multiplexed += p.objects.size();
            }
            if (p.safety) {
                ++safety;
            } else if (!p.to_node) {
                ++received;
            } else {
                sent += !users.contains(cob);
            }
            const auto [first, last] = users.equal_range(cob);
            for (auto u = first; u != last; ++u) {
                const std::string why = why_not_shared(*u->second.pdo, p);
                if (why.empty()) continue;
                report.error(Topic::node, p.at,
                             called({&n, &p}) + " and " + called(u->second) +
                                 " have the same identifier " +
                                 lower(index_text(static_cast<std::uint16_t>(cob_id(p.cob)))),
                             why);
                break;
            }
            users.emplace(cob, User{&n, &p});
        }
    }
    for (std::size_t i = 0; i < config.foreign.size(); ++i) {
        for (std::size_t k = 0; k < i; ++k) {
            if (config.foreign[i].id == config.foreign[k].id &&
                config.foreign[i].extended == config.foreign[k].extended &&
                config.foreign[i].remote == config.foreign[k].remote) {
                report.error(Topic::node, config.foreign[i].at,
                             "duplicate identifier: also used in line " +
                                 std::to_string(config.foreign[k].at.line),
                             "two senders of one identifier destroy each other's frames");
            }
        }
    }
    for (const unsigned count : {sent, received}) {
        if (count > 512) {
            report.error(Topic::node, config.at,
                         "the nodes have " + std::to_string(count) +
                             " PDOs in one direction; the limit is 512",
                         "move some nodes to a second bus with its own configuration");
        }
    }
    if (multiplexed > max_multiplexed) {
        report.error(Topic::node, config.at,
                     "the nodes send " + std::to_string(multiplexed) +
                         " objects in multiplexed PDOs; the limit is " +
                         std::to_string(max_multiplexed),
                     "move some nodes to a second bus with its own configuration");
    }
    if (safety > Srdos::max_srdos) {
        report.error(
            Topic::node, config.at,
            "the nodes have " + std::to_string(safety) + " SRDOs; the limit of a bus is 64");
    }
    if (!report.failed()) {
        for (const std::string& problem : problems_of(config.setup())) {
            report.error(Topic::node, config.at, problem);
        }
    }
}

}  // namespace hal::canopen::config
