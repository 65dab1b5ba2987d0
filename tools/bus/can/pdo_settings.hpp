// SPDX-License-Identifier: MIT
// How the PDOs of a node are set up, as the node itself or its EDS says.
#pragma once

#include <string>
#include <vector>

#include "bus/can/objects.hpp"
#include "bus/can/station.hpp"

namespace hal::tools {

struct PdoSettings {
    struct Item {
        ObjectName object;
        unsigned bits = 0;
        std::uint32_t entry() const { return std::uint32_t{object.index} << 16 | std::uint32_t{object.sub} << 8 | bits; }
    };
    bool received = false;   ///< by the node: an RPDO
    unsigned number = 1;     ///< from 1
    std::uint32_t cob = canopen::cob_invalid;
    std::uint8_t transmission = 255, sync_start = 0, count = 0;  ///< count: sub-index 0 of the mapping
    std::uint16_t inhibit_100us = 0, event_ms = 0;
    bool has_inhibit = false, has_event = false;
    std::vector<Item> mapping = {};

    std::uint16_t communication_index() const { return static_cast<std::uint16_t>((received ? 0x1400 : 0x1800) + number - 1); }
    std::uint16_t mapping_index() const { return static_cast<std::uint16_t>(communication_index() + 0x200); }
    bool on() const { return (cob & canopen::cob_invalid) == 0; }
    bool matches(const can::Frame& f) const {
        return on() && !f.remote && f.id == canopen::cob_id(cob) && f.extended == ((cob & canopen::cob_extended) != 0);
    }
    unsigned bits() const;
    std::string name() const;      ///< "TPDO1"
    std::string identifier() const;  ///< "181", "off"
    std::string timing() const;    ///< "every SYNC", "on event, at most every 10 ms"
};

/// `rpdo1`, `TPDO12`. False when it is none.
bool parse_pdo(const std::string& text, PdoSettings&);
/// Reads one from the node. Abort::no_object: it has no such PDO.
canopen::Abort read_pdo(Station&, std::uint8_t node, const ObjectNames&, PdoSettings&);
/// All of a node. False after saying why.
bool read_pdos(Station&, const Options&, std::uint8_t node, const ObjectNames&, std::vector<PdoSettings>&);
/// As the EDS or DCF has them, for a node that cannot be asked.
std::vector<PdoSettings> described_pdos(const ObjectNames&, std::uint8_t node);

}  // namespace hal::tools
