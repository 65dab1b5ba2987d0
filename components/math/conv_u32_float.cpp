// SPDX-License-Identifier: MIT
#include "conv.hpp"

using Converter = conv::Converter<std::uint32_t, double>;
HAL_COMPONENT(Converter, "conv_u32_float", "Converts u32 to float", Converter::manual)
