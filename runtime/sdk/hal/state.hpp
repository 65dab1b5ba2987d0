// SPDX-License-Identifier: MIT
// What an instance remembers, handed to the next version of its component by `reload`.
#pragma once

#include "hal/component.hpp"

namespace hal {

/// A variable of an instance that survives `reload`: `hal::State<double> sum{*this, "sum",
/// "integral of the error"}`. The new version starts with the value of the old one where it
/// declares a state of the same name and type; else with `initial`. It is a read-only parameter,
/// shown by `show param` and read by `getp`; only its component writes it.
template <PinType T>
    requires(!std::same_as<T, Port>)
class State {
public:
    State(Component&, const char* name, const char* doc, T initial = {}, const char* unit = "") {
        hal_pin_decl decl{};
        decl.size = sizeof decl;
        decl.type = detail::type_of<T>();
        decl.dir = HAL_DIR_PARAM;
        decl.flags = HAL_PIN_READ_ONLY;
        decl.name = name;
        decl.doc = doc;
        decl.unit = unit;
        decl.initial = to_value<T>(initial);
        pin_.own = decl.initial;
        pin_.slot = &pin_.own;
        if (!detail::creating->pin(detail::creating, &decl, &pin_)) {
            detail::rejected();
        }
    }
    State(const State&) = delete;

    T get() const noexcept { return detail::load<T, false>(pin_.slot); }  ///< [realtime]
    operator T() const noexcept { return get(); }
    /// [realtime]
    State& operator=(T value) noexcept { return detail::store<T>(pin_.slot, value), *this; }
    State& operator=(const State& other) noexcept { return *this = other.get(); }
    State& operator+=(T value) noexcept
        requires(!std::same_as<T, bool>)
    {
        return *this = static_cast<T>(get() + value);
    }

private:
    hal_pin pin_;
};

}  // namespace hal
