// SPDX-License-Identifier: MIT
#include "conv.hpp"

using Converter = conv::Converter<std::int64_t, double>;
HAL_COMPONENT(Converter, "conv_s64_float", "Converts s64 to float", Converter::manual)
