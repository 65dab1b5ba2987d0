// SPDX-License-Identifier: MIT
// The peer of the section `ethercat`: SOEM through its Python package pysoem.
#pragma once

#include <optional>
#include <string>

#include "bench.hpp"

namespace hal::bench {

/// Medians; times of a cycle in us.
struct Soem {
    std::optional<double> start_ms, wall, cpu, paced;
    std::string why;  ///< there is no figure
};

/// SOEM as master at the interface `here`, with the slaves `line` at `there`, on the CPU and with
/// the priority of our own master.
Soem soem(const Options&, const std::string& here, const std::string& there,
          const std::string& line);

}  // namespace hal::bench
