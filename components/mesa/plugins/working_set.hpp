// SPDX-License-Identifier: MIT
// Objects in the memory of the instance. The thread fetches that into the caches before its
// deadline: a cycle that comes once in a millisecond would find nothing of it there.
#pragma once

#include <memory>
#include <new>
#include <utility>

#include "hal/component.hpp"

namespace hal::mesa {

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

/// Makes an object in the memory of the instance that is being created. [setup]
template <class T, class... Arguments>
Placed<T> place(Arguments&&... arguments) {
    const hal_host* const host = hal::detail::creating;
    void* const memory = host->allocate(host, sizeof(T), alignof(T));
    if (memory == nullptr) throw std::bad_alloc();
    return Placed<T>(::new (memory) T(std::forward<Arguments>(arguments)...));
}

}  // namespace hal::mesa
