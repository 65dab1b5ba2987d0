// SPDX-License-Identifier: MIT
#include "conv.hpp"

using Converter = conv::Converter<std::int64_t, std::uint32_t>;
HAL_COMPONENT(Converter, "conv_s64_u32", "Converts s64 to u32", Converter::manual)
