// SPDX-License-Identifier: MIT
// The heap memory of components at addresses that are the same in each process that executes the
// same edits, so that its bytes are a state (machine_state.hpp, docs/internals/journal.md).
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace hal {

/// What `operator new` returns to a component once track() was called. It is in segments: one for
/// the memory of the instances themselves, one for what components allocate in cycles, one for each
/// setup call that allocates something. Memory is zero when it is allocated and after its release,
/// so that no byte depends on what was there before. [any], not in a real-time thread
namespace component_heap {

/// The segments begin here: below the area of mmap, whichever way it grows, and below a program
/// that is loaded anywhere. A state is restored only where they begin at the same address.
constexpr std::uint64_t heap_begin = 0x1000'0000'0000;

/// Call before the first component is loaded. Reserves the addresses of all segments. Returns why
/// that is not possible, as in a build that has its own `operator new`; "" when it is done.
std::string track();

/// Returns whether an address is in a segment, used or not.
bool has(std::uint64_t address);

struct Segment {
    std::uint32_t number = 0;
    char* begin = nullptr;
    std::size_t used = 0;  ///< bytes
};
/// Of allocations in cycles: what is in it has no counterpart in a process that has executed only
/// the edits.
constexpr std::uint32_t grown_segment = 1;

/// Returns the segments that are used, by number.
std::vector<Segment> segments();
/// Makes a segment as large as it was elsewhere, and returns its memory; nullptr: it is too large,
/// or there is no memory. Its content decides which blocks exist.
char* resized(const Segment& segment);
/// Returns why memory of components is not in a segment; "" when all of it is. `function_named`
/// returns the name of a function by its number.
std::string problem(const std::function<std::string(std::uint32_t)>& function_named);

}  // namespace component_heap
}  // namespace hal
