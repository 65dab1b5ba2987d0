// SPDX-License-Identifier: MIT
#include "conv.hpp"

using Converter = conv::Converter<double, std::int32_t>;
HAL_COMPONENT(Converter, "conv_float_s32", "Converts float to s32", Converter::manual)
