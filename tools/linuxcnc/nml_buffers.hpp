// SPDX-License-Identifier: MIT
// The buffers of an NML configuration that are in shared memory.
#pragma once

#include <optional>
#include <string>
#include <sys/types.h>
#include <vector>

namespace hal::tools {

struct NmlBuffer {
    std::string name;
    std::optional<key_t> key;  ///< of its System V segment; nullopt: not a number
    std::optional<std::size_t> processes;  ///< how many may use it
};

/// Returns them in the order of the file; none when the file cannot be read.
std::vector<NmlBuffer> shared_nml_buffers(const std::string& file);

}  // namespace hal::tools
