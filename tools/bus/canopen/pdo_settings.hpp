// SPDX-License-Identifier: MIT
// The settings of PDOs, as read from the node or its EDS.
#pragma once

#include <string>
#include <vector>

#include "bus/canopen/node_client.hpp"
#include "bus/canopen/objects.hpp"

namespace hal::tools {

struct PdoSettings {
    static constexpr unsigned max_mapped = 64;  ///< objects of CiA 301

    struct Item {
        ObjectName object;
        unsigned bits = 0;
        std::uint32_t entry() const {
            return std::uint32_t{object.index} << 16 | std::uint32_t{object.sub} << 8 | bits;
        }
    };
    bool received = false;   ///< by the node: an RPDO
    unsigned number = 1;     ///< from 1
    std::uint32_t cob = canopen::cob_invalid;
    std::uint8_t transmission = 255;
    std::uint8_t sync_start = 0;
    std::uint8_t count = 0;  ///< sub-index 0 of the mapping: mapped objects, or a kind of MPDO
    std::uint16_t inhibit_100us = 0;
    std::uint16_t event_ms = 0;
    bool has_inhibit = false;
    bool has_event = false;
    std::vector<Item> mapping = {};

    static std::uint16_t first_communication_index(bool received) {
        return received ? 0x1400 : 0x1800;
    }
    std::uint16_t communication_index() const {
        return static_cast<std::uint16_t>(first_communication_index(received) + number - 1);
    }
    std::uint16_t mapping_index() const {
        return static_cast<std::uint16_t>(communication_index() + 0x200);
    }
    bool on() const { return (cob & canopen::cob_invalid) == 0; }
    bool matches(const can::Frame& f) const {
        return on() && !f.remote && f.id == canopen::cob_id(cob) &&
               f.extended == ((cob & canopen::cob_extended) != 0);
    }
    bool is_multiplexed() const { return count > max_mapped; }  ///< an MPDO, with no mapping
    unsigned bits() const;
    std::string name() const;      ///< "TPDO1"
    std::string identifier() const;  ///< "181", "off"
    std::string timing() const;    ///< "every SYNC", "on event, at most every 10 ms"
};

/// Parses `rpdo1`, `TPDO12`. Returns false for an invalid one.
bool parse_pdo(const std::string& text, PdoSettings&);
/// Reads a PDO from the node. Abort::no_object: no such PDO.
canopen::Abort read_pdo(NodeClient&, std::uint8_t node, const ObjectNames&, PdoSettings&);
/// Reads all PDOs of a node. Returns false after printing the reason.
bool read_pdos(NodeClient&, const Options&, std::uint8_t node, const ObjectNames&,
               std::vector<PdoSettings>&);
/// Returns the PDOs of the EDS or DCF, for a node that cannot be read.
std::vector<PdoSettings> described_pdos(const ObjectNames&, std::uint8_t node);

}  // namespace hal::tools
