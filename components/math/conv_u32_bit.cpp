// SPDX-License-Identifier: MIT
#include "conv.hpp"

using Converter = conv::Converter<std::uint32_t, bool>;
HAL_COMPONENT(Converter, "conv_u32_bit", "Converts u32 to bit", Converter::manual)
