// SPDX-License-Identifier: MIT
#include "conv.hpp"

namespace {

struct ScaledS32Sums : hal::Component {
    using Component::Component;
    hal::Ins<std::int32_t> in{*this, "in#", 4, "summand #"};
    hal::Ins<double> scale{*this, "scale#", 4, "factor of summand #", {.initial = 1.0}};
    hal::Out<std::int32_t> out_s{*this, "out-s", "sum, truncated and limited to the range of s32"};
    hal::Out<double> out_f{*this, "out-f", "sum"};
    hal::Function run{*this, "", hal::step<&ScaledS32Sums::update>, "computes the sum"};

    void update(hal::Cycle) noexcept {
        double sum = 0.0;
        for (std::size_t i = 0; i < in.size(); ++i) {
            sum += in[i] * scale[i].get();
        }
        out_f = sum;
        out_s = conv::convert<std::int32_t>(sum, true);
    }
};

}  // namespace

HAL_COMPONENT(ScaledS32Sums, "scaled_s32_sums", "Weighted sum of four integers", R"(
`out-f = in0 * scale0 + in1 * scale1 + in2 * scale2 + in3 * scale3`. `out-s` is the sum truncated to
an integer and limited to the range of s32, and 0 while the sum is NaN.

    # two hand wheels, one of them fine
    loadrt scaled_s32_sums names=jog
    addf jog servo
    setp jog.scale0 10
    net wheel-coarse => jog.in0
    net wheel-fine   => jog.in1
    net jog-counts   <= jog.out-s
)")
