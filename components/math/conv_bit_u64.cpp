// SPDX-License-Identifier: MIT
#include "conv.hpp"

using Converter = conv::Converter<bool, std::uint64_t>;
HAL_COMPONENT(Converter, "conv_bit_u64", "Converts bit to u64", Converter::manual)
