// SPDX-License-Identifier: MIT
// What passes between the nodes of a netlist: a signal that one node writes and others read. Each
// node has a model of its own part; signals of equal names are one signal when exactly one node
// writes it and another reads it without writing it.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "model/model.hpp"
#include "text/diagnostic.hpp"

namespace hal {

/// One node with its own part as a model.
struct NodePart {
    std::string name;
    const Model* model = nullptr;
    std::int64_t rate_ns = 0;
    std::int64_t deadline_ns = 0;
    /// a place in the texts of its model as one in the texts that diagnostics are rendered with
    std::function<Span(Span)> place;
};

/// A node that reads a signal of another one.
struct NodeReader {
    std::size_t node = 0;
    /// the value that `sets` gave it there, used while the node of the writer is offline
    hal_value safe{};
    std::vector<const Pin*> pins;
};

struct NodeField {
    std::string signal;
    hal_type type = HAL_TYPE_BIT;
    const Pin* writer = nullptr;
    std::vector<NodeReader> readers;
};

/// The signals that the functions of one thread write for other nodes. They are sent together, so
/// that all are of one cycle.
struct NodeTopic {
    std::size_t from = 0;
    std::string thread;
    std::vector<NodeField> fields;  ///< by name of the signal
    std::int64_t rate_ns = 0;
    std::int64_t deadline_ns = 0;

    bool read_by(std::size_t node) const;
    /// The signals as they stand on the line: "speed:float, ready:bit". Nodes whose texts differ
    /// cannot understand each other.
    std::string layout() const;
};

/// The topics between the nodes, in order of their writers' names. Reports what cannot pass.
std::vector<NodeTopic> topics_between(const std::vector<NodePart>& nodes, Diagnostics& diagnostics);

/// The thread that sends or takes what these pins write or read: the fastest of theirs; without one
/// the node's fastest. nullptr: it has none.
const Thread* thread_for(const Model& model, const std::vector<const Pin*>& pins);

}  // namespace hal
