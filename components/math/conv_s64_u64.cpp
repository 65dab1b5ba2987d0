// SPDX-License-Identifier: MIT
#include "conv.hpp"

using Converter = conv::Converter<std::int64_t, std::uint64_t>;
HAL_COMPONENT(Converter, "conv_s64_u64", "Converts s64 to u64", Converter::manual)
