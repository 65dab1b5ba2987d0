// SPDX-License-Identifier: MIT
// The concise DCF of CiA 302 (object 1F22): the writes that configure a node, as one block of bytes.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "eds.hpp"

namespace hal::canopen::eds {

struct Write {
    std::uint16_t             index = 0;
    std::uint8_t              sub = 0;
    std::vector<std::uint8_t> data;

    bool operator==(const Write&) const = default;
};

struct Configuration {
    std::vector<Write>   writes;         ///< in the order they have to be made
    std::vector<Message> messages;     ///< what was left out, and why
};

/// The writes that make a node which holds the defaults of `dcf` hold its parameter values: only what differs, or with `all` every
/// parameter value. PDOs are switched off, mapped and switched on again in the order CiA 301 demands. `node_id` replaces that of the file
/// unless it is 0.
Configuration configuration_of(const DeviceDescription& dcf, unsigned node_id = 0, bool all = false);

/// u32 count, then per write u16 index, u8 sub-index, u32 size and the data, all little endian.
std::vector<std::uint8_t> concise(std::span<const Write> writes);

/// The opposite; none when the bytes are no concise DCF.
std::optional<std::vector<Write>> parse_concise(std::span<const std::uint8_t> bytes);

/// A value of the file as bytes: its parameter value, else its default. Empty when it has none that can be encoded.
std::vector<std::uint8_t> value_of(const Entry& entry, unsigned node_id);

}  // namespace hal::canopen::eds
