// SPDX-License-Identifier: MIT
#include "conv.hpp"

using Converter = conv::Converter<std::uint32_t, std::int64_t>;
HAL_COMPONENT(Converter, "conv_u32_s64", "Converts u32 to s64", Converter::manual)
