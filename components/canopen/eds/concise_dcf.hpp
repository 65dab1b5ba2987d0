// SPDX-License-Identifier: MIT
// The concise DCF of CiA 302 (object 1F22): the writes that configure a node, as one block of
// bytes.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "eds.hpp"

namespace hal::canopen::eds {

struct Write {
    std::uint16_t index = 0;
    std::uint8_t sub = 0;
    std::vector<std::uint8_t> data;

    bool operator==(const Write&) const = default;
};

struct Configuration {
    std::vector<Write> writes;         ///< in the order in which they must be made
    std::vector<Message>
        messages;     ///< omitted values and the reasons; an error: the value is invalid
};

/// Returns the writes that configure a node with the parameter values of `dcf`: those that differ
/// from the defaults, or with `all` every one. PDOs are disabled, mapped and enabled again in the
/// order of CiA 301. `node_id` replaces that of the file unless it is 0.
Configuration configuration_of(const DeviceDescription& dcf, unsigned node_id = 0,
                               bool all = false);

/// Encodes a concise DCF: u32 count, then per write u16 index, u8 sub-index, u32 size and the data,
/// all little endian.
std::vector<std::uint8_t> concise(std::span<const Write> writes);

/// Decodes a concise DCF. Returns nothing if the bytes are invalid.
std::optional<std::vector<Write>> parse_concise(std::span<const std::uint8_t> bytes);

/// Encodes the parameter value of an entry, else its default. Returns nothing if the value is
/// missing or invalid.
std::vector<std::uint8_t> value_of(const Entry& entry, unsigned node_id);

}  // namespace hal::canopen::eds
