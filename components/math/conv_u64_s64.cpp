// SPDX-License-Identifier: MIT
#include "conv.hpp"

using Converter = conv::Converter<std::uint64_t, std::int64_t>;
HAL_COMPONENT(Converter, "conv_u64_s64", "Converts u64 to s64", Converter::manual)
