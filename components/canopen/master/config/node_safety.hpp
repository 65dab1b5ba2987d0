// SPDX-License-Identifier: MIT
// The SRDOs of a node (EN 50325-5): tsrdoN and rsrdoN, each object with the one that holds it
// inverted. [setup]
#pragma once

#include "canopen/protocol/srdo_description.hpp"
#include "node_pdos.hpp"

namespace hal::canopen::config {

class NodeSrdos {
public:
    explicit NodeSrdos(const NodeInput& input)
        : in_(input), report_(input.report), node_(input.node) {}
    void read();
    /// Adds the writes that configure the SRDOs in the node.
    void configure();

private:
    void srdo(const PdoRequest& request);
    void read_pair(const Word& word, Pdo& pdo);
    void options(const PdoRequest& request, Pdo& pdo);
    void check_shared(const Pdo& pdo);

    const NodeInput& in_;
    Report& report_;
    Node& node_;
};

/// Returns the configuration of an SRDO in the node. [setup]
SrdoDescription node_srdo(const Pdo&);

}  // namespace hal::canopen::config
