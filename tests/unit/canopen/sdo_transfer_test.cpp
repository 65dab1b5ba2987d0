// SPDX-License-Identifier: MIT
// SDO transfers of all sizes between client and server, on a wire that loses, repeats and delays
// frames.
#include <tuple>

#include "sdo_bed.hpp"

namespace hal::canopen::test {
namespace {

constexpr std::size_t sizes[] = {1, 4, 5, 7, 8, 14, 21, 889, 890, 1000, 10'000, 1 << 20};

class Sizes : public testing::TestWithParam<std::tuple<std::size_t, SdoMode>> {};

TEST_P(Sizes, Transfers_complete_in_both_directions_on_a_good_wire) {
    const auto [size, mode] = GetParam();
    SdoBed p;
    const auto data = pattern(size, 1);
    std::vector<std::uint8_t> buffer(size + 3);
    SdoRequest down{.index = 0x2006, .mode = mode, .data = data};

    SdoRequest up{.index = 0x2006, .upload = true, .mode = mode, .buffer = buffer};
    ASSERT_TRUE(p.run(down));
    EXPECT_TRUE(down.ok()) << to_string(down.abort);
    ASSERT_TRUE(p.run(up));
    EXPECT_TRUE(up.ok()) << to_string(up.abort);
    EXPECT_EQ(up.size, size);
    EXPECT_TRUE(std::equal(data.begin(), data.end(), buffer.begin()));
    EXPECT_EQ(down.retries + up.retries, 0U);
    EXPECT_EQ(p.client.unexpected_responses(), 0U);
}

std::string size_name(const testing::TestParamInfo<Sizes::ParamType>& info) {
    return std::to_string(std::get<0>(info.param)) +
           (std::get<1>(info.param) == SdoMode::block ? "_block" : "_segmented");
}
INSTANTIATE_TEST_SUITE_P(All, Sizes,
                         testing::Combine(testing::ValuesIn(sizes),
                                          testing::Values(SdoMode::segmented, SdoMode::block)),
                         size_name);

enum class Fault { lose, repeat, delay };

class Disturbed : public testing::TestWithParam<std::tuple<Fault, unsigned, SdoMode, bool>> {};

/// Whatever the wire does: every transfer ends, and one that reports success carried the right
/// bytes.
TEST_P(Disturbed, Transfers_are_correct_or_report_failure_on_a_disturbed_wire) {
    const auto [fault, n, mode, tolerant] = GetParam();
    for (const auto size : sizes) {
        if (size > 1000 && n <= 3) continue;
        // transfers that cannot succeed only cost time
        if (size > 10'000 && !(mode == SdoMode::block && n >= 97)) continue;
        SdoBed p(tolerant);
        p.bus.faults = {.lose = fault == Fault::lose ? n : 0,
                        .repeat = fault == Fault::repeat ? n : 0,
                        .delay = fault == Fault::delay ? n : 0};
        const auto data = pattern(size, n);
        std::vector<std::uint8_t> buffer(size);
        SdoRequest down{.index = 0x2006, .mode = mode, .data = data};

        SdoRequest up{.index = 0x2006, .upload = true, .mode = mode, .buffer = buffer};
        ASSERT_TRUE(p.run(down)) << size;
        const auto& e = *p.device.dictionary().find(0x2006, 0);
        if (down.ok()) {
            ASSERT_EQ(e.size, size);
            ASSERT_TRUE(std::equal(data.begin(), data.end(), e.data)) << size;
        } else {
            // until the server has timed out as well
            for (int wait = 0; wait < 2000; ++wait) {
                p.device.poll(p.now += millisecond);
            }
            std::copy(data.begin(), data.end(), e.data);
            const_cast<Entry&>(e).size = static_cast<std::uint32_t>(size);
        }
        ASSERT_TRUE(p.run(up)) << size;
        if (up.ok()) {
            ASSERT_EQ(up.size, size);
            ASSERT_EQ(buffer, data) << size;
        }
        // The protocol recovers blocks, and segments if the server tolerates repeats.
        const bool recoverable = n >= 5 && (fault != Fault::delay) &&
                                 ((mode == SdoMode::block && size > 21) || tolerant);
        if (recoverable) {
            EXPECT_TRUE(down.ok()) << size << ": " << to_string(down.abort);
            EXPECT_TRUE(up.ok()) << size << ": " << to_string(up.abort);
        }
    }
}

std::string name_of(const testing::TestParamInfo<Disturbed::ParamType>& info) {
    const auto [fault, n, mode, tolerant] = info.param;
    return std::string(fault == Fault::lose     ? "lose_"
                       : fault == Fault::repeat ? "repeat_"
                                                : "delay_") +
           std::to_string(n) + (mode == SdoMode::block ? "_block" : "_segmented") +
           (tolerant ? "_tolerant" : "");
}
INSTANTIATE_TEST_SUITE_P(All, Disturbed,
                         testing::Combine(testing::Values(Fault::lose, Fault::repeat, Fault::delay),
                                          testing::Values(2U, 3U, 5U, 7U, 13U, 50U, 97U, 1009U),
                                          testing::Values(SdoMode::segmented, SdoMode::block),
                                          testing::Bool()),
                         name_of);

}  // namespace
}  // namespace hal::canopen::test
