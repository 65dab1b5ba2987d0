// SPDX-License-Identifier: MIT
#include "conv.hpp"

using Converter = conv::Converter<std::int32_t, bool>;
HAL_COMPONENT(Converter, "conv_s32_bit", "Converts s32 to bit", Converter::manual)
