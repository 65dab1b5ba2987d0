// SPDX-License-Identifier: MIT
#include "conv.hpp"

using Converter = conv::Converter<std::int32_t, std::uint32_t>;
HAL_COMPONENT(Converter, "conv_s32_u32", "Converts s32 to u32", Converter::manual)
