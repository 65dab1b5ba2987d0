// SPDX-License-Identifier: MIT
// Configurations that commands of `hal ethercat` take.
#pragma once

#include <string>

#include "cli/option_set.hpp"
#include "ethercat/config/config.hpp"

namespace hal::tools {

/// Reads a configuration. Returns false after printing what is wrong with it; warnings are printed
/// as well. [setup]
bool read_bus_file(const Options& options, const std::string& path,
                   ethercat::config::ReadResult& reading);

}  // namespace hal::tools
