// SPDX-License-Identifier: MIT
#include "conv.hpp"

using Converter = conv::Converter<std::int64_t, std::int32_t>;
HAL_COMPONENT(Converter, "conv_s64_s32", "Converts s64 to s32", Converter::manual)
