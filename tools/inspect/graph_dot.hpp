// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "inspect/graph_view.hpp"

namespace hal::tools {

/// The selected part of a netlist as a Graphviz drawing: a table per instance with a port per pin,
/// functions with their place in their thread, edges coloured by type; dashed and marked z⁻¹ where
/// the value is one cycle old, dotted where it comes from another thread.
std::string as_dot(const Model& model, const GraphView& view, const std::string& title);

}  // namespace hal::tools
