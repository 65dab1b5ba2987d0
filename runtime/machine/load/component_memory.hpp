// SPDX-License-Identifier: MIT
// Marks what the runtime allocates for a component: a journal can begin with its content
// (runtime/journal/component_heap.hpp).
#pragma once

namespace hal {

/// While it exists, the calling thread allocates memory of a component. [setup]
class ComponentMemory {
public:
    ComponentMemory() noexcept { ++depth_; }
    ~ComponentMemory() { --depth_; }
    ComponentMemory(const ComponentMemory&) = delete;
    static bool is_allocated() noexcept { return depth_ > 0; }

private:
    inline static thread_local int depth_ = 0;
};

}  // namespace hal
