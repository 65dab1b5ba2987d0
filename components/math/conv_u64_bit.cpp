// SPDX-License-Identifier: MIT
#include "conv.hpp"

using Converter = conv::Converter<std::uint64_t, bool>;
HAL_COMPONENT(Converter, "conv_u64_bit", "Converts u64 to bit", Converter::manual)
