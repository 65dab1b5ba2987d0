// SPDX-License-Identifier: MIT
#include "conv.hpp"

using Converter = conv::Converter<std::uint64_t, double>;
HAL_COMPONENT(Converter, "conv_u64_float", "Converts u64 to float", Converter::manual)
