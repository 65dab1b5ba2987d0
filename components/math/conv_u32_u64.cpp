// SPDX-License-Identifier: MIT
#include "conv.hpp"

using Converter = conv::Converter<std::uint32_t, std::uint64_t>;
HAL_COMPONENT(Converter, "conv_u32_u64", "Converts u32 to u64", Converter::manual)
