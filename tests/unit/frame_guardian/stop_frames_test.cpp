// SPDX-License-Identifier: MIT
#include "fieldbus/guardian/stop_frames.hpp"

namespace hal::guardian {
namespace {

TEST(StopFrames, Are_parsed_in_their_order) {
    StopFrames frames;
    EXPECT_EQ(parse("201#0000,18FF0001#01.02,000#0200,123##1AABB", "701#04", frames), "");
    ASSERT_EQ(frames.can.size(), 4U);
    EXPECT_TRUE(frames.can[0].same({0x201, {0, 0}}));
    EXPECT_TRUE(frames.can[1].same({0x18ff0001, {1, 2}}));
    EXPECT_TRUE(frames.can[1].extended);
    EXPECT_TRUE(frames.can[2].same({0, {2, 0}}));
    EXPECT_TRUE(frames.can[3].fd);
    EXPECT_TRUE(frames.can[3].bit_rate_switch);
    ASSERT_EQ(frames.confirmations.size(), 1U);
    EXPECT_TRUE(frames.confirmations[0].same({0x701, {4}}));
}

TEST(StopFrames, On_Ethernet_have_separators_where_one_likes) {
    StopFrames frames;
    EXPECT_EQ(
        parse("01005E000001.020000000001.88B5.4242,01:00:5e:00:00:01-0200000000018892", "", frames),
        "");
    ASSERT_EQ(frames.ethernet.size(), 2U);
    EXPECT_EQ(frames.ethernet[0].size(), 16U);
    EXPECT_EQ(frames.ethernet[0][0], 0x01);
    EXPECT_EQ(frames.ethernet[0][15], 0x42);
    EXPECT_EQ(frames.ethernet[1].size(), 14U);
    EXPECT_EQ(frames.ethernet[1][13], 0x92);
}

TEST(StopFrames, Are_limited_in_number) {
    StopFrames frames;
    std::string list = "201#00";
    for (std::size_t n = 1; n < max_frames; ++n) {
        list += ",201#00";
    }
    EXPECT_EQ(parse(list, "", frames), "");
    EXPECT_EQ(frames.can.size(), max_frames);
    EXPECT_EQ(parse(list + ",201#00", "", frames = {}), "more than 32 frames");
}

TEST(StopFrames, That_no_controller_sends_are_rejected) {
    for (const char* const text : {"201#1", "201#112233445566778899", "801#", "#00", "201#0G",
                                   "201##1112233445566778899", "201#00,", ",201#00"}) {
        StopFrames frames;
        EXPECT_TRUE(parse(text, "", frames).starts_with("invalid frame '")) << text;
    }
}

}  // namespace
}  // namespace hal::guardian
