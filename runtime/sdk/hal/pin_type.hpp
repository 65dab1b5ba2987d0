// SPDX-License-Identifier: MIT
// The C++ types of pins and their HAL types: for code that learns the type of a pin at load time.
#pragma once

#include <concepts>
#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <type_traits>

#include "hal/abi.h"
#include "hal/port.hpp"

namespace hal {

template <class T>
inline constexpr bool is_pin_type =
    std::is_same_v<T, bool> || std::is_same_v<T, double> || std::is_same_v<T, std::int32_t> ||
    std::is_same_v<T, std::uint32_t> || std::is_same_v<T, std::int64_t> ||
    std::is_same_v<T, std::uint64_t> || std::is_same_v<T, Port>;

template <class T>
concept PinType = is_pin_type<T>;

namespace detail {
template <class T>
constexpr hal_type type_of() {
    if constexpr (std::same_as<T, bool>) {
        return HAL_TYPE_BIT;
    } else if constexpr (std::same_as<T, double>) {
        return HAL_TYPE_FLOAT;
    } else if constexpr (std::same_as<T, std::int32_t>) {
        return HAL_TYPE_S32;
    } else if constexpr (std::same_as<T, std::uint32_t>) {
        return HAL_TYPE_U32;
    } else if constexpr (std::same_as<T, std::int64_t>) {
        return HAL_TYPE_S64;
    } else if constexpr (std::same_as<T, std::uint64_t>) {
        return HAL_TYPE_U64;
    } else {
        return HAL_TYPE_PORT;
    }
}
}  // namespace detail

/// Returns a slot with this value; its other bytes are 0. [any]
template <PinType T>
hal_value to_value(T v) noexcept {
    hal_value value{};
    if constexpr (!std::same_as<T, Port>) {
        std::memcpy(&value, &v, sizeof v);
    }
    return value;
}
/// Returns the member of `value` that is a `T`. [any]
template <PinType T>
    requires(!std::same_as<T, Port>)
T value_as(const hal_value& value) noexcept {
    T member;
    std::memcpy(&member, &value, sizeof member);
    return member;
}

/// Calls `action` with a std::type_identity of the C++ type of `type`, and returns its result. A
/// port has no value: it throws std::invalid_argument. [setup]
template <class Action>
decltype(auto) visit_type(hal_type type, Action&& action) {
    switch (type) {
    case HAL_TYPE_BIT: return action(std::type_identity<bool>{});
    case HAL_TYPE_FLOAT: return action(std::type_identity<double>{});
    case HAL_TYPE_S32: return action(std::type_identity<std::int32_t>{});
    case HAL_TYPE_U32: return action(std::type_identity<std::uint32_t>{});
    case HAL_TYPE_S64: return action(std::type_identity<std::int64_t>{});
    case HAL_TYPE_U64: return action(std::type_identity<std::uint64_t>{});
    case HAL_TYPE_PORT: break;
    }
    throw std::invalid_argument("a port has no value");
}

}  // namespace hal
