// SPDX-License-Identifier: MIT
// Short names of types and access rights, for tables of objects:
//
//     using namespace cia301::shorthand;
//     d.add(0x1001, 0, u8, ro, 0, "Error register");
#pragma once

#include "cia301/types.hpp"

namespace hal::cia301::shorthand {

inline constexpr auto boolean = Type::boolean;
inline constexpr auto i8 = Type::integer8;
inline constexpr auto i16 = Type::integer16;
inline constexpr auto i32 = Type::integer32;
inline constexpr auto u8 = Type::unsigned8;
inline constexpr auto u16 = Type::unsigned16;
inline constexpr auto u32 = Type::unsigned32;
inline constexpr auto real = Type::real32;

inline constexpr auto rw = Access::read_write;
inline constexpr auto ro = Access::read_only;
inline constexpr auto fixed = Access::constant;

}  // namespace hal::cia301::shorthand
