// SPDX-License-Identifier: MIT
// The writes by which a master configures the SRDOs of a node (EN 50325-5).
#pragma once

#include <vector>

#include "canopen/protocol/srdo_description.hpp"
#include "object_writes.hpp"

namespace hal::canopen {

/// Returns the writes that set the parameters and the signature of SRDO `number`. They become valid
/// by srdo_valid_write(), once after the writes of all SRDOs. [setup]
std::vector<ObjectWrite> srdo_writes(unsigned number, const SrdoDescription&);
/// Returns the write of 13FEh that makes the configuration valid. [setup]
ObjectWrite srdo_valid_write();

}  // namespace hal::canopen
