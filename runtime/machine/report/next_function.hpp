// SPDX-License-Identifier: MIT
#pragma once

#include <atomic>

#include <dlfcn.h>

namespace hal {

/// The function of the C library that stands behind one of ours of the same name. [any]
template <class Function>
class NextFunction {
public:
    explicit constexpr NextFunction(const char* name) noexcept : name_(name) {}
    Function* operator*() noexcept {
        // no guarded initialisation: the guard may need a system call
        Function* found = found_.load(std::memory_order_relaxed);
        if (found == nullptr) {
            found = reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name_));
            found_.store(found, std::memory_order_relaxed);
        }
        return found;
    }

private:
    const char* const name_;
    std::atomic<Function*> found_{nullptr};
};

}  // namespace hal
