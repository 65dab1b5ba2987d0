// SPDX-License-Identifier: MIT
#include "conv.hpp"

using Converter = conv::Converter<double, std::uint64_t>;
HAL_COMPONENT(Converter, "conv_float_u64", "Converts float to u64", Converter::manual)
