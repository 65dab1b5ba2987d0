// SPDX-License-Identifier: MIT
// Memory in the order of its allocation, for a netlist that is loaded, looked at and dropped as a
// whole, as an editor does with each keystroke. The program's `operator new` and `operator delete`
// (journal/component_heap.cpp) ask here first.
//
//   chunk 0               chunk 1               chunk 2
//   [object|object|...]   [object|...   free]   [not used yet]
//    live: 3               open: at -^            a chunk without a live object is used again
//
// A free block of the heap is joined with its neighbours, and an object of a second netlist comes
// to lie wherever the first one left a hole. Here freeing counts down, and the objects of a netlist
// lie side by side.
#pragma once

#include <cstddef>

namespace hal::region {

/// While it exists, `operator new` of the calling thread takes small blocks from chunks. They may
/// be freed at any time, by any thread. Does nothing where the addresses cannot be reserved, and in
/// a program with another `operator new`. [setup]
class Scope {
public:
    Scope() noexcept;
    ~Scope();
    Scope(const Scope&) = delete;
};

/// Returns nullptr outside of a Scope, for a large block, and without memory. [setup]
void* allocate(std::size_t bytes, std::size_t alignment) noexcept;
/// Returns true for a block from allocate(). [any]
bool has(const void* memory) noexcept;
/// Takes back a block for which has() is true; `bytes` as at its allocation, 0: unknown. [setup]
void release(void* memory, std::size_t bytes) noexcept;
/// Returns the number of chunks that are open or have a live object. [setup]
std::size_t chunks_in_use() noexcept;

}  // namespace hal::region
