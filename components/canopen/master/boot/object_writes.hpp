// SPDX-License-Identifier: MIT
// The objects that a master writes to a node before it starts it, in order.
//
//     std::vector<ObjectWrite> writes = rpdo_writes(1, {.cob = 0x205, .mapping = {map_entry(0x6040, 0, 16)}});
//     writes.push_back(object_write(0x6083, 0, std::uint32_t{1000}, "profile acceleration"));
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "canopen/eds/concise_dcf.hpp"
#include "canopen/protocol/description.hpp"

namespace hal::canopen {

/// One object to write.
struct ObjectWrite : eds::Write {
    std::string name{};  ///< for messages
    /// written without comparing or verifying: a command, or an object that reads back as another
    /// value
    bool always = false;
    bool optional = false;  ///< skipped if the node does not have the object
};

/// Returns the write of a value of type T, little endian. [setup]
template <class T>
ObjectWrite object_write(std::uint16_t index, std::uint8_t sub, T value, std::string name = {}) {
    ObjectWrite w{{index, sub, std::vector<std::uint8_t>(sizeof(T))}, std::move(name)};
    store(w.data.data(), value);
    return w;
}

/// Returns the writes that configure RPDO `number` of a node, 1..512, in the remapping order of CiA
/// 301: disable, clear the mapping, entries, count, communication parameters, enable. `node` is the
/// node ID that PdoDescription::plus_node_id adds. With cob 0, PDOs 1..4 get the predefined COB-ID
/// and others stay disabled. An empty mapping disables the PDO and leaves its mapping unchanged.
/// [setup]
std::vector<ObjectWrite> rpdo_writes(unsigned number, const PdoDescription&, std::uint8_t node = 0);
/// Returns the writes that configure TPDO `number` of a node; see rpdo_writes(). [setup]
std::vector<ObjectWrite> tpdo_writes(unsigned number, const PdoDescription&, std::uint8_t node = 0);

/// Converts the writes of a DCF or of object 1F22h (concise DCF). [setup]
std::vector<ObjectWrite> object_writes(std::span<const eds::Write>);

/// Returns true if the value `found` in the node equals the value `expected`. Of a disabled PDO
/// only bit 31 of the COB-ID is compared, and bit 30 never: many devices return their own.
/// [realtime]
bool same_value(std::uint16_t index, std::uint8_t sub, std::span<const std::uint8_t> expected,
                std::span<const std::uint8_t> found) noexcept;

}  // namespace hal::canopen
