// SPDX-License-Identifier: MIT
#include "conv.hpp"

using Converter = conv::Converter<bool, std::uint32_t>;
HAL_COMPONENT(Converter, "conv_bit_u32", "Converts bit to u32", Converter::manual)
