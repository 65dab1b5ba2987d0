// SPDX-License-Identifier: MIT
// The master's own objects of CiA 302, so that a tool or a gateway reads by SDO what the master was told, and commands nodes: 102Ah,
// 1F80h, 1F81h, 1F82h (request NMT), 1F84h–1F89h.
//
//     Description d = basic_device({...});
//     add_master_objects(d, setup);                  // [setup]
//     Device own(d, ...);  Master master(setup, own.out(), events);
//     MasterObjects objects(own.dictionary(), master);
#pragma once

#include "canopen/protocol/dictionary.hpp"
#include "nmt_master.hpp"

namespace hal::canopen {

/// What apply_startup() and apply_assignment() understand, the other way round. [setup]
std::uint32_t startup_of(const MasterSetup&);
std::uint32_t assignment_of(const NodeSetup&);

/// [setup]
void add_master_objects(Description&, const MasterSetup&);

/// Serves 1F82h:n, the state of node n and, written, a command to it; 1F82h:128 commands all.
class MasterObjects final : private Handler {
public:
    MasterObjects(Dictionary&, Master&);  // [setup] both outlive it

private:
    Abort reading(Entry&) noexcept override;
    Abort writing(Entry&, std::span<const std::uint8_t>) noexcept override;
    Master& master_;
};

}  // namespace hal::canopen
