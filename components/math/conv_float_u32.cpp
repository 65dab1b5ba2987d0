// SPDX-License-Identifier: MIT
#include "conv.hpp"

using Converter = conv::Converter<double, std::uint32_t>;
HAL_COMPONENT(Converter, "conv_float_u32", "Converts float to u32", Converter::manual)
