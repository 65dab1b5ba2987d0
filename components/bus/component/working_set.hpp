// SPDX-License-Identifier: MIT
// Objects in the memory of the instance. The thread fetches that into the caches before its
// deadline: a cycle that comes once in a millisecond would find nothing of it there.
#pragma once

#include <cstddef>
#include <memory>
#include <new>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

#include "hal/component.hpp"

namespace hal::bus {

/// Destroys an object, whose memory is the instance's.
struct DestroyPlaced {
    template <class T>
    void operator()(T* object) const noexcept {
        std::destroy_at(object);
    }
};

/// An object in the memory of the instance: it ends before the instance.
template <class T>
using Placed = std::unique_ptr<T, DestroyPlaced>;

/// Allocates memory in that of the instance that is being created. [setup]
inline void* allocate_in_instance(std::size_t size, std::size_t alignment) {
    const hal_host* const host = hal::detail::creating;
    void* const memory = host->allocate(host, size, alignment);
    if (memory == nullptr) throw std::bad_alloc();
    return memory;
}

/// Makes an object in the memory of the instance that is being created. [setup]
template <class T, class... Arguments>
Placed<T> place(Arguments&&... arguments) {
    void* const memory = allocate_in_instance(sizeof(T), alignof(T));
    return Placed<T>(::new (memory) T(std::forward<Arguments>(arguments)...));
}

/// Copies a list into the memory of the instance that is being created. [setup]
template <class T>
std::span<const T> place_list(const std::vector<T>& list) {
    static_assert(std::is_trivially_copyable_v<T>);
    if (list.empty()) return {};
    auto* const first = static_cast<T*>(allocate_in_instance(list.size() * sizeof(T), alignof(T)));
    std::uninitialized_copy(list.begin(), list.end(), first);
    return {first, list.size()};
}

}  // namespace hal::bus
