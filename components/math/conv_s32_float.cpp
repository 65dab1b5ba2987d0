// SPDX-License-Identifier: MIT
#include "conv.hpp"

using Converter = conv::Converter<std::int32_t, double>;
HAL_COMPONENT(Converter, "conv_s32_float", "Converts s32 to float", Converter::manual)
