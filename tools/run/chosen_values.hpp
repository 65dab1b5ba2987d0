// SPDX-License-Identifier: MIT
// Which values of a machine in this process are recorded, and their rows.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "machine/run/probes.hpp"
#include "model/model.hpp"
#include "record/sink.hpp"

namespace hal::tools {

/// Of rows that are taken at once, in bytes.
inline constexpr std::size_t max_taken = std::size_t{1} << 28;

/// Returns all signals, pins and parameters that match; without patterns, all signals and what has
/// none. Each value once. The session's lock must be held.
std::vector<std::string> chosen_values(const Model& model,
                                       const std::vector<std::string>& patterns);

/// Returns the names in their order, each pattern replaced by what it matches. The session's lock
/// must be held.
std::vector<std::string> named_values(const Model& model, const std::vector<std::string>& patterns);

/// States which of the names is unknown; "" when all are known. The session's lock must be held.
std::string unknown_value(const Model& model, const std::vector<std::string>& patterns);

/// Adds rows to the file, and their layout before them if it is another one. `count` is the number
/// of rows so far. Returns false when they cannot be written.
bool add_rows(Sink& sink, const ProbeRows& rows, ProbeLayout& layout, std::uint64_t& count);

}  // namespace hal::tools
