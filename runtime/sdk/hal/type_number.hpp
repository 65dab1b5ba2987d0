// SPDX-License-Identifier: MIT
// A number per type, by which a reload finds out that a variable is no longer what it was.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <type_traits>
#include <utility>

namespace hal::detail {

template <class T>
std::uint64_t type_number();

/// FNV-1a over the bytes of a number.
constexpr std::uint64_t hash_of(std::uint64_t hash, std::uint64_t number) {
    for (int byte = 0; byte < 8; ++byte) {
        hash = (hash ^ ((number >> (8 * byte)) & 0xff)) * 1099511628211U;
    }
    return hash;
}

template <class T>
constexpr std::uint64_t name_number() {
    std::uint64_t hash = 14695981039346656037U;
    for (const char c : std::string_view{__PRETTY_FUNCTION__}) {
        hash = (hash ^ static_cast<unsigned char>(c)) * 1099511628211U;
    }
    return hash;
}

/// Initialises any member of an aggregate `Whole`, and adds the member's type to a hash.
template <class Whole>
struct MemberType {
    std::uint64_t* hash;

    template <class Member>
        requires(!std::is_same_v<Member, Whole> && std::is_default_constructible_v<Member>)
    operator Member() const {
        *hash = hash_of(*hash, type_number<Member>());
        return Member{};
    }
};

template <class Whole, std::size_t>
using MemberAt = MemberType<Whole>;

template <class T, std::size_t... Index>
constexpr bool has_members(std::index_sequence<Index...>) {
    return requires(MemberType<T> any) { T{MemberAt<T, Index>{any}...}; };
}

/// Returns how many initialisers the aggregate T takes, of at most Most.
template <class T, std::size_t Most = 48>
constexpr std::size_t member_count() {
    if constexpr (Most == 0 || has_members<T>(std::make_index_sequence<Most>{})) {
        return Most;
    } else {
        return member_count<T, Most - 1>();
    }
}

template <class T, std::size_t... Index>
void add_members(std::uint64_t& hash, std::index_sequence<Index...>) {
    [[maybe_unused]] const T whole{MemberAt<T, Index>{&hash}...};
}

/// Returns a number that differs for types of different names or sizes, and for structs without a
/// constructor or private members also when the types of their first 48 members differ in order.
/// Members that change their meaning and keep their type keep the number: rename the struct.
template <class T>
std::uint64_t type_number() {
    std::uint64_t hash = hash_of(name_number<T>(), sizeof(T));
    if constexpr (std::is_class_v<T> && std::is_aggregate_v<T>) {
        add_members<T>(hash, std::make_index_sequence<member_count<T>()>{});
    }
    return hash;
}

}  // namespace hal::detail
