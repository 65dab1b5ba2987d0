// SPDX-License-Identifier: MIT
#include "conv.hpp"

using Converter = conv::Converter<double, std::int64_t>;
HAL_COMPONENT(Converter, "conv_float_s64", "Converts float to s64", Converter::manual)
