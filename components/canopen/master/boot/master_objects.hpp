// SPDX-License-Identifier: MIT
// The objects of CiA 302 in the master's own dictionary, by which a tool or a gateway reads the
// set-up and commands nodes over SDO: 102Ah, 1F80h, 1F81h, 1F82h (request NMT), 1F84h–1F89h.
//
//     Description d = basic_device({...});
//     add_master_objects(d, setup);                  // [setup]
//     Device own(d, ...);  Master master(setup, own.out(), events);
//     MasterObjects objects(own.dictionary(), master);
#pragma once

#include "canopen/protocol/dictionary.hpp"
#include "nmt_master.hpp"

namespace hal::canopen {

/// Returns the value of 1F80h (NMT startup); the inverse of apply_startup(). [setup]
std::uint32_t startup_of(const MasterSetup&);
/// Returns the value of 1F81h (NMT slave assignment); the inverse of apply_assignment(). [setup]
std::uint32_t assignment_of(const NodeSetup&);

/// Adds the objects to the description of the master. [setup]
void add_master_objects(Description&, const MasterSetup&);

/// Serves 1F82h: sub-index n returns the state of node n and, written, commands it; sub-index 128
/// commands all nodes (CiA 302-2).
class MasterObjects final : private Handler {
public:
    /// Installs the handler; both arguments outlive it. [setup]
    MasterObjects(Dictionary&, Master&);

private:
    Abort reading(Entry&) noexcept override;
    Abort writing(Entry&, std::span<const std::uint8_t>) noexcept override;
    Master& master_;
};

}  // namespace hal::canopen
