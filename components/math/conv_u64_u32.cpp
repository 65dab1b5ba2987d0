// SPDX-License-Identifier: MIT
#include "conv.hpp"

using Converter = conv::Converter<std::uint64_t, std::uint32_t>;
HAL_COMPONENT(Converter, "conv_u64_u32", "Converts u64 to u32", Converter::manual)
