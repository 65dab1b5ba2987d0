// SPDX-License-Identifier: MIT
// SRDOs of a device's description: the objects 1300h to 13FFh and their signature (EN 50325-5, formerly CiA 304).
#pragma once

#include <span>
#include <vector>

#include "description.hpp"
#include "srdo.hpp"

namespace hal::canopen {

/// Communication and mapping parameters of one SRDO.
struct SrdoDescription {
    SrdoDirection direction = SrdoDirection::none;
    std::uint16_t cycle_ms = 50;       ///< sent: the refresh time; received: the SCT
    std::uint8_t validation_ms = 20;   ///< the SRVT
    std::uint32_t cob = 0;             ///< of the first frame, odd; the second has the next. 0: of SRDO 1 0FFh + 2 · id
    std::vector<std::uint32_t> mapping{};  ///< plain, inverted, plain, inverted …
};

/// Objects 1300h, 1301h …, 1381h …, 13FEh and 13FFh for SRDOs 1, 2, 3 …, valid from power-on where all have a cob. [setup]
void add_srdos(Description&, std::span<const SrdoDescription>);

/// The signature 13FFh: CRC-16 over 1301h:1, 2, 3, 5, 6, 1381h:0, and each further sub-index with its number before it. [any]
std::uint16_t srdo_signature(const SrdoDescription&) noexcept;

}  // namespace hal::canopen
