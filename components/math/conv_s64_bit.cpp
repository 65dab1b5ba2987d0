// SPDX-License-Identifier: MIT
#include "conv.hpp"

using Converter = conv::Converter<std::int64_t, bool>;
HAL_COMPONENT(Converter, "conv_s64_bit", "Converts s64 to bit", Converter::manual)
