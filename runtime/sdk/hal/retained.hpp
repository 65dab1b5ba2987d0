// SPDX-License-Identifier: MIT
// Ordinary members that survive `reload`: the state machine, latches, edges, ramps and integrals of
// a component.
#pragma once

#include <array>
#include <atomic>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <type_traits>

#include "hal/component.hpp"
#include "hal/queue.hpp"
#include "hal/retained.h"
#include "hal/type_number.hpp"

namespace hal {

namespace detail {

/// A class declares `static constexpr bool retainable = true` when its bytes are its whole state:
/// it contains no pointer and may be copied byte by byte while nobody uses it.
template <class T>
concept DeclaresRetainable = requires { requires T::retainable; };

template <class T>
inline constexpr bool is_retainable = std::is_trivially_copyable_v<T> || DeclaresRetainable<T>;
template <class T>
inline constexpr bool is_retainable<std::atomic<T>> = is_retainable<T>;
template <class T>
inline constexpr bool is_retainable<Mailbox<T>> = is_retainable<T>;
template <class T, std::size_t N>
inline constexpr bool is_retainable<std::array<T, N>> = is_retainable<T>;

template <class T>
concept Retainable = is_retainable<T> && !std::is_const_v<T> && !std::is_pointer_v<T>;

/// A vector or a matrix: elements of one type in a row.
template <class T>
concept Elements = !Retainable<T> && requires(T& all) {
    { all.size() } -> std::convertible_to<std::size_t>;
    requires Retainable<std::remove_reference_t<decltype(*all.data())>>;
};

}  // namespace detail

/// Names a variable for hal::Retained. It is trivially copyable, an atomic, or a class that
/// declares itself `retainable`, and contains no pointer.
class RetainedVariable {
public:
    template <detail::Retainable T>
    RetainedVariable(const char* name, T& variable) : RetainedVariable(name, &variable, 1) {}
    /// A row that keeps its place and its size after the constructor of the component.
    template <detail::Elements T>
    RetainedVariable(const char* name, T& row)
        : RetainedVariable(name, row.data(), static_cast<std::size_t>(row.size())) {}
    /// The same, `count` elements from `first` on.
    template <detail::Retainable T>
    RetainedVariable(const char* name, T* first, std::size_t count) {
        what_.size = sizeof what_;
        what_.name = name;
        what_.type = detail::type_number<T>();
        what_.memory = first;
        what_.bytes = count * sizeof(T);
    }
    const hal_variable& declaration() const { return what_; }

private:
    hal_variable what_{};
};

/// Members of a component that `reload` carries over: `hal::Retained retained{*this, {{"integral",
/// integral_}, {"was-enabled", was_enabled_}}};`. It follows the members that it names. The new
/// version starts with the value of the old one where it names a variable of the same type alike;
/// else with its own. A single value that shall be shown, too, is a hal::State.
class Retained {
public:
    Retained(Component&, std::initializer_list<RetainedVariable> variables) {
        const auto* const host = extension<hal_retained>(HAL_RETAINED);
        if (host == nullptr) return;  // it cannot reload
        for (const RetainedVariable& variable : variables) {
            if (!host->declare(detail::creating, &variable.declaration())) {
                detail::rejected();
            }
        }
    }
    Retained(const Retained&) = delete;
    Retained& operator=(const Retained&) = delete;
};

}  // namespace hal
