// SPDX-License-Identifier: MIT
// What a device description allows of PDOs: which exclude each other, which must be assigned, how
// many objects each takes. Everything here is [setup].
#pragma once

#include <string>
#include <vector>

#include "ethercat/config/config_text.hpp"

namespace hal::ethercat::config {

/// Returns "1600".
std::string pdo_text(std::uint16_t index);

/// Returns whether a PDO names the other one in Exclude. Files often have it on one side only.
bool exclude_each_other(const esi::Pdo&, const esi::Pdo&);

/// Returns how many objects the mapping of a PDO takes: the sub-indices of its object in the
/// dictionary; 0: unknown.
unsigned max_entries(const esi::Device&, std::uint16_t pdo);

/// Returns the PDOs of a direction that can be mapped anew, together: mandatory ones first, then
/// those that are assigned by default.
std::vector<std::uint16_t> mappable(const esi::Device&, bool output);

/// What the PDOs of a slave are checked against.
struct PdoContext {
    const esi::Device& device;
    const esi::OpMode* mode;  ///< of the distributed clocks; nullptr: none
    const std::string& type;  ///< of the slave, for messages
    unsigned samples = 1;  ///< in a cycle, of PDOs with samples
};

/// Checks what a slave has assigned in a direction against its description, and reports at `at`.
/// `key` is "outputs" or "inputs".
void check_pdos(const PdoContext&, const std::vector<master::SyncManager>&, bool output,
                const std::string& key, Span at, Report&);

}  // namespace hal::ethercat::config
