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

namespace {

/// The rules for the PDOs and SRDOs of all nodes together.
class NetworkCheck {
public:
    NetworkCheck(const MasterConfig& config, Report& report) : config_(config), report_(report) {}

    void run() {
        for (const Node& node : config_.nodes) {
            for (const Pdo& pdo : node.pdos) {
                const User user{&node, &pdo};
                count(user);
                check_identifier(user);
                users_.emplace(identifier(pdo), user);
            }
        }
        check_foreign();
        check_counts();
    }

private:
    struct User {
        const Node* node;
        const Pdo* pdo;
    };

    static std::uint32_t identifier(const Pdo& pdo) {
        return pdo.cob & (cob_extended | 0x1fffffff);
    }

    static std::string label(const User& user) {
        const std::string direction = user.pdo->to_node ? "r" : "t";
        const std::string kind = user.pdo->safety ? "srdo" : "pdo";
        return direction + kind + std::to_string(user.pdo->number) + " of '" + user.node->name +
               "'";
    }

    /// One frame of the master may serve several nodes.
    void count(const User& user) {
        const Pdo& pdo = *user.pdo;
        if (pdo.multiplexed() && !pdo.to_node) {
            multiplexed_ += pdo.objects.size();
        }
        if (pdo.safety) {
            ++safety_;
        } else if (!pdo.to_node) {
            ++received_;
        } else if (!users_.contains(identifier(pdo))) {
            ++sent_;
        }
    }

    /// Reports the first of the earlier users with which the identifier cannot be shared.
    void check_identifier(const User& user) {
        const auto [first, last] = users_.equal_range(identifier(*user.pdo));
        for (auto other = first; other != last; ++other) {
            const std::string why = why_not_shared(*other->second.pdo, *user.pdo);
            if (why.empty()) continue;
            const auto cob = static_cast<std::uint16_t>(cob_id(user.pdo->cob));
            report_.error(Topic::node, user.pdo->at,
                          label(user) + " and " + label(other->second) +
                              " have the same identifier " + lower(index_text(cob)),
                          why);
            return;
        }
    }

    static bool is_same_frame(const Foreign& a, const Foreign& b) {
        return a.id == b.id && a.extended == b.extended && a.remote == b.remote;
    }

    void check_foreign() {
        const auto& foreign = config_.foreign;
        for (std::size_t i = 0; i < foreign.size(); ++i) {
            for (std::size_t k = 0; k < i; ++k) {
                if (!is_same_frame(foreign[i], foreign[k])) continue;
                report_.error(
                    Topic::node, foreign[i].at,
                    "duplicate identifier: also used in line " + std::to_string(foreign[k].at.line),
                    "two senders of one identifier destroy each other's frames");
            }
        }
    }

    void check_counts() {
        constexpr std::size_t max_pdos = 512;
        constexpr std::size_t max_multiplexed = 48 * 254;  // rows of 1FD0h to 1FFFh
        for (const std::size_t count : {sent_, received_}) {
            if (count > max_pdos) {
                exceeded("have " + std::to_string(count) + " PDOs in one direction", max_pdos);
            }
        }
        if (multiplexed_ > max_multiplexed) {
            exceeded("send " + std::to_string(multiplexed_) + " objects in multiplexed PDOs",
                     max_multiplexed);
        }
        if (safety_ > Srdos::max_srdos) {
            report_.error(Topic::node, config_.at,
                          "the nodes have " + std::to_string(safety_) +
                              " SRDOs; the limit of a bus is " + std::to_string(Srdos::max_srdos));
        }
    }

    void exceeded(const std::string& what, std::size_t limit) {
        report_.error(Topic::node, config_.at,
                      "the nodes " + what + "; the limit is " + std::to_string(limit),
                      "move some nodes to a second bus with its own configuration");
    }

    const MasterConfig& config_;
    Report& report_;
    std::multimap<std::uint32_t, User> users_;
    std::size_t sent_ = 0;
    std::size_t received_ = 0;
    std::size_t multiplexed_ = 0;
    std::size_t safety_ = 0;
};

}  // namespace

void check_network(const MasterConfig& config, Report& report) {
    NetworkCheck(config, report).run();
    if (report.failed()) return;
    for (const std::string& problem : problems_of(config.setup())) {
        report.error(Topic::node, config.at, problem);
    }
}

}  // namespace hal::canopen::config
