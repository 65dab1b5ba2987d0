// SPDX-License-Identifier: MIT
#include "conv.hpp"

using Converter = conv::Converter<bool, std::int64_t>;
HAL_COMPONENT(Converter, "conv_bit_s64", "Converts bit to s64", Converter::manual)
