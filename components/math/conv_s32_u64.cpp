// SPDX-License-Identifier: MIT
#include "conv.hpp"

using Converter = conv::Converter<std::int32_t, std::uint64_t>;
HAL_COMPONENT(Converter, "conv_s32_u64", "Converts s32 to u64", Converter::manual)
