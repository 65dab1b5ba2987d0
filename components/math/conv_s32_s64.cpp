// SPDX-License-Identifier: MIT
#include "conv.hpp"

using Converter = conv::Converter<std::int32_t, std::int64_t>;
HAL_COMPONENT(Converter, "conv_s32_s64", "Converts s32 to s64", Converter::manual)
