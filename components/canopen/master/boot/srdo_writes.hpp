// SPDX-License-Identifier: MIT
// The writes by which a master gives the SRDOs of its configuration to a node.
#pragma once

#include <vector>

#include "canopen/protocol/srdo_description.hpp"
#include "object_writes.hpp"

namespace hal::canopen {

/// The writes that give SRDO `number` of a node these parameters and its signature. What makes them valid is srdo_valid_write(), once,
/// after those of all SRDOs. [setup]
std::vector<ObjectWrite> srdo_writes(unsigned number, const SrdoDescription&);
ObjectWrite srdo_valid_write();

}  // namespace hal::canopen
