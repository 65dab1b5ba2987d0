// SPDX-License-Identifier: MIT
// Marks what the runtime allocates for a component: a journal can begin with its content
// (runtime/journal/component_heap.hpp).
#pragma once

#include <utility>

namespace hal {

/// While it exists, the calling thread allocates memory of a component. [setup]
class ComponentMemory {
public:
    /// `component`: its name, which outlives this.
    explicit ComponentMemory(const char* component) noexcept
        : before_(std::exchange(component_, component)) {}
    ~ComponentMemory() { component_ = before_; }
    ComponentMemory(const ComponentMemory&) = delete;
    /// Returns the component's name; nullptr: the thread allocates no such memory.
    static const char* component() noexcept { return component_; }

private:
    const char* const before_;
    inline static thread_local const char* component_ = nullptr;
};

}  // namespace hal
