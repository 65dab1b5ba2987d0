// SPDX-License-Identifier: MIT
// The master's own object dictionary: what a node sends is received here and the other way round,
// an object each.
#pragma once

#include <cstdint>
#include <vector>

#include "canopen/master/config/master_config.hpp"
#include "canopen/protocol/description.hpp"

namespace hal::canopen {

/// An object of a node and the one of ours that stands for it: a signed or unsigned number of 64
/// bits, or a real; of one that comes by a multiplexed PDO the node's own type.
struct Placed {
    std::size_t node = 0;                    ///< in MasterConfig::nodes
    bool to_node = false;
    const config::Object* object = nullptr;  ///< of the configuration, which outlives this
    std::uint16_t index = 0;
    std::uint8_t sub = 0;
};

/// Which RPDO of ours takes which PDO of a node.
struct Received {
    std::size_t node = 0;
    const config::Pdo* pdo = nullptr;
    unsigned number = 0;
};

/// A TPDO of ours. Several nodes may take their parts of it: then it stands for an RPDO of each,
/// all with the same identifier. Of a multiplexed one each part goes alone, with the object it is
/// for.
struct Sent {
    struct Part {
        std::size_t placed = 0;
        std::uint8_t first = 0;
        std::uint8_t bits = 0;
    };
    const config::Pdo* pdo = nullptr;  ///< of the first of them
    unsigned number = 0;
    std::vector<Part> parts{};         ///< by their first bit; what lies between them is zero
};

/// Which SRDO of ours takes or makes which one of a node.
struct OwnSrdo {
    std::size_t node = 0;
    const config::Pdo* pdo = nullptr;
    unsigned number = 0;
    std::vector<std::size_t> placed{};  ///< its objects
};

struct OwnNode {
    Description description;
    /// one for each object and node, however many PDOs carry it; fillers are not among them
    std::vector<Placed> placed;
    std::vector<Received> received;
    std::vector<Sent> sent;
    std::vector<OwnSrdo> srdos;
};

/// [setup]
OwnNode own_node(const config::MasterConfig&);

}  // namespace hal::canopen
