// SPDX-License-Identifier: MIT
// What a master writes to a node before it starts it: a list of object writes, in order.
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

struct ObjectWrite : eds::Write {
    std::string name{};     ///< for messages
    bool always = false;    ///< written unread and not verified: an object that acts, or reads as something else
    bool optional = false;  ///< a node without this object will do
};

/// One object, its value little endian in as many bytes as T has. [setup]
template <class T>
ObjectWrite object_write(std::uint16_t index, std::uint8_t sub, T value, std::string name = {}) {
    ObjectWrite w{{index, sub, std::vector<std::uint8_t>(sizeof(T))}, std::move(name)};
    store(w.data.data(), value);
    return w;
}

/// The writes that give PDO `number` (from 1, as the node sees it) these parameters, in the order CiA 301 demands: off, mapping cleared,
/// entries, their count, communication parameters, on. `node` is added to `cob` where that says so; without a cob PDO 1–4 get the
/// predefined one and others stay off. An empty mapping switches the PDO off and leaves its mapping as it is. [setup]
std::vector<ObjectWrite> rpdo_writes(unsigned number, const PdoDescription&, std::uint8_t node = 0);
std::vector<ObjectWrite> tpdo_writes(unsigned number, const PdoDescription&, std::uint8_t node = 0);

/// Those of a DCF or of object 1F22h. [setup]
std::vector<ObjectWrite> object_writes(std::span<const eds::Write>);

/// Whether a node that returns `found` for this object has the value `wished`. Of the COB-ID of a PDO that is off only that counts, and
/// bit 30 never: many devices answer with their own. [realtime]
bool same_value(std::uint16_t index, std::uint8_t sub, std::span<const std::uint8_t> wished, std::span<const std::uint8_t> found) noexcept;

}  // namespace hal::canopen
