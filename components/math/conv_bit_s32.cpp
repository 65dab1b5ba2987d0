// SPDX-License-Identifier: MIT
#include "conv.hpp"

using Converter = conv::Converter<bool, std::int32_t>;
HAL_COMPONENT(Converter, "conv_bit_s32", "Converts bit to s32", Converter::manual)
