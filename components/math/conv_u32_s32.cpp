// SPDX-License-Identifier: MIT
#include "conv.hpp"

using Converter = conv::Converter<std::uint32_t, std::int32_t>;
HAL_COMPONENT(Converter, "conv_u32_s32", "Converts u32 to s32", Converter::manual)
