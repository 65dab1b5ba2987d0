// SPDX-License-Identifier: MIT
// A host of components for tests without a runtime.
#pragma once

#include <cstdlib>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "hal/component.hpp"

namespace hal::ethercat {

/// A host that gives memory and finds the pins again by their names.
class PinHost {
public:
    const hal_host* get() const noexcept { return &host_; }
    template <class T>
    T& value(const std::string& pin) {
        return *reinterpret_cast<T*>(pins_.at(pin)->slot);
    }
    /// Returns "out u32" and the like, by the name of the pin.
    const std::map<std::string, std::string>& declared() const noexcept { return declared_; }

private:
    static PinHost& of(const hal_host* host) { return *static_cast<PinHost*>(host->data); }
    static bool pin(const hal_host* host, const hal_pin_decl* decl, hal_pin* memory) {
        constexpr const char* types[] = {"bit", "float", "s32", "u32", "s64", "u64", "port"};
        constexpr const char* directions[] = {"in", "out", "io", "param"};
        of(host).pins_[decl->name] = memory;
        of(host).declared_[decl->name] =
            std::string(directions[decl->dir]) + " " + types[decl->type];
        return true;
    }
    static bool function(const hal_host*, const hal_function_decl*) { return true; }
    static void* allocate(const hal_host* host, std::size_t bytes, std::size_t) {
        return of(host).memory_.emplace_back(std::calloc(1, bytes), &std::free).get();
    }

    std::map<std::string, hal_pin*> pins_;
    std::map<std::string, std::string> declared_;
    std::vector<std::unique_ptr<void, void (*)(void*)>> memory_;
    hal_host host_ = [this] {
        hal_host host{};
        host.size = sizeof host;
        host.data = this;
        host.pin = &pin;
        host.function = &function;
        host.allocate = &allocate;
        return host;
    }();
};

}  // namespace hal::ethercat
