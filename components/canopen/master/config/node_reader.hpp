// SPDX-License-Identifier: MIT
// Reads a node from its keys. [setup]
#pragma once

#include "node_descriptions.hpp"
#include "object_reader.hpp"

namespace hal::canopen::config {

/// What the readers of a node's keys share.
struct NodeInput {
    Keys& keys;
    Report& report;
    const MasterConfig& bus;
    Node& node;
    const Catalog& catalog;
    /// nullptr: the node has no device description
    const eds::DeviceDescription* eds;
    /// its description is invalid, which was reported: unknown objects are not
    bool undescribed;

    ObjectReader objects() const { return {catalog, undescribed, report}; }
};

/// Reads all keys of a node.
void read_node(Keys&, Report&, Descriptions&, const MasterConfig& bus, Node&);

}  // namespace hal::canopen::config
