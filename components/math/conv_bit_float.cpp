// SPDX-License-Identifier: MIT
#include "conv.hpp"

using Converter = conv::Converter<bool, double>;
HAL_COMPONENT(Converter, "conv_bit_float", "Converts bit to float", Converter::manual)
