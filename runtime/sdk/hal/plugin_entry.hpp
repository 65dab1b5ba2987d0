// SPDX-License-Identifier: MIT
// What HAL_COMPONENT exports: the functions by which the host makes, starts, stops and destroys an
// instance. Include hal/component.hpp.
#pragma once

#include <concepts>
#include <cstdint>
#include <exception>
#include <new>
#include <type_traits>
#include <utility>

#include "hal/abi.h"
#include "hal/rejection.hpp"

namespace hal {

class Component;
namespace detail {
// set while a constructor of this plugin runs
inline thread_local const hal_host* creating = nullptr;
}  // namespace detail

/// Properties of a component as a whole: `static constexpr hal::Traits traits{.singleton = true};`
struct Traits {
    bool singleton = false;  ///< one instance, named like the component without a number
    std::uint32_t default_count = 1;  ///< instances of a bare `loadrt`
};

namespace detail {
template <class C>
constexpr Traits traits_of() {
    if constexpr (requires { C::traits; }) {
        return C::traits;
    } else {
        return {};
    }
}

template <class C>
constexpr bool starts() {
    return requires(C& c, const hal_host& host) { c.start(host); } ||
           requires(C& c) { c.start(); } || requires(C& c) { c.stop(); };
}

template <class Action>
bool guarded(const hal_host* host, Action action) noexcept {
    try {
        action();
        return true;
    } catch (const Rejection& rejection) {
        rejection.report(host);
    } catch (const std::exception& e) {
        if (*e.what() != '\0') {
            host->fail(host, e.what());
        }
    } catch (...) {
        host->fail(host, "an exception that is not a std::exception");
    }
    return false;
}

template <class C>
void construct(const hal_host* host, void* memory) {
    new (memory) C(host);  // missing line in the component: using Component::Component;
}

template <std::derived_from<Component> C>
constexpr hal_component component(const char* name, const char* summary, const char* doc = "") {
    // An error in the declaration of a member also makes C unconstructible; C is then not an
    // aggregate, because the constructor is inherited.
    static_assert(std::is_constructible_v<C, const hal_host*> || !std::is_aggregate_v<C>,
                  "missing line in the component: using Component::Component;");
    constexpr Traits traits = traits_of<C>();
    return {
        sizeof(hal_component),
        HAL_ABI_MAJOR,
        HAL_ABI_MINOR,
        name,
        summary,
        doc,
        (traits.singleton ? unsigned{HAL_COMPONENT_SINGLETON} : 0u) |
            (starts<C>() ? unsigned{HAL_COMPONENT_STARTS} : 0u),
        traits.default_count,
        sizeof(C),
        alignof(C),
        [](const hal_host* host, void* memory) {
        return guarded(host, [&] { construct<C>(host, memory); });
    },
        [](void* self, const hal_host* host) {
        return guarded(host, [&] {
            detail::creating = host;
            if constexpr (requires(C& c) { c.start(*host); }) {
                static_cast<C*>(self)->start(*host);
            } else if constexpr (requires(C& c) { c.start(); }) {
                static_cast<C*>(self)->start();
            }
        });
    },
        [](void* self) {
        if constexpr (requires(C& c) { c.stop(); }) {
            static_assert(noexcept(std::declval<C&>().stop()), "stop() must be noexcept");
            static_cast<C*>(self)->stop();
        }
    },
        [](void* self) { static_cast<C*>(self)->~C(); },
    };
}
}  // namespace detail

}  // namespace hal
