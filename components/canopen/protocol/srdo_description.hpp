// SPDX-License-Identifier: MIT
// The SRDOs in a device description: objects 1300h to 13FFh and their signatures (EN 50325-5,
// formerly CiA 304).
#pragma once

#include <span>
#include <vector>

#include "description.hpp"
#include "srdo.hpp"

namespace hal::canopen {

/// Communication and mapping parameters of one SRDO.
struct SrdoDescription {
    SrdoDirection direction = SrdoDirection::none;
    std::uint16_t cycle_ms = 50;       ///< sent: refresh time; received: SCT
    std::uint8_t validation_ms = 20;   ///< SRVT
    /// identifier of the first frame, odd; the second frame has the next one. 0: for SRDO 1, 0FFh +
    /// 2 * node ID
    std::uint32_t cob = 0;
    std::vector<std::uint32_t> mapping{};  ///< mapping entries: plain, inverted, plain, inverted, …
};

/// Adds the objects 1300h, 1301h…, 1381h…, 13FEh and 13FFh for SRDOs 1, 2, 3…; the configuration is
/// valid from power-on if all have a COB-ID. [setup]
void add_srdos(Description&, std::span<const SrdoDescription>);

/// Returns the signature for 13FFh: CRC-16 over 1301h:1, 2, 3, 5, 6, 1381h:0 and each further
/// sub-index preceded by its number. [any]
std::uint16_t srdo_signature(const SrdoDescription&) noexcept;

}  // namespace hal::canopen
