// SPDX-License-Identifier: MIT
// What `operator new` has allocated, and for whom: heap memory that belongs to the state of an
// instance (machine_state.hpp).
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace hal {

struct HeapBlock {
    enum class Origin : std::uint8_t {
        setup,  ///< code of a component in a constructor or start()
        cycle,
        host,  ///< the program itself, before the first setup call or within one
        later,  ///< after the first setup call, outside of cycles and setup calls
    };
    char* begin = nullptr;
    std::size_t bytes = 0;
    Origin origin = Origin::host;
    /// Of a setup call: which one, counted from 1, and which of its allocations, counted from 0.
    /// The same in each execution of the same edits.
    std::uint32_t call = 0;
    std::uint32_t index = 0;
};

/// Of this process. [any], not in a real-time thread
namespace heap_blocks {

/// Begins to note allocations. Returns false in a build that has its own `operator new`.
bool track();
/// Returns the block that has this byte.
std::optional<HeapBlock> find(const void* byte);
/// Returns the blocks of setup calls that still exist.
std::vector<HeapBlock> of_setup_calls();

}  // namespace heap_blocks
}  // namespace hal
