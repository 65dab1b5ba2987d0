// SPDX-License-Identifier: MIT
#include "conv.hpp"

using Converter = conv::Converter<std::uint64_t, std::int32_t>;
HAL_COMPONENT(Converter, "conv_u64_s32", "Converts u64 to s32", Converter::manual)
