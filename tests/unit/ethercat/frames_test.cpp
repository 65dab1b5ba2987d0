// SPDX-License-Identifier: MIT
#include "ethercat/wire/frames.hpp"

#include <gtest/gtest.h>

#include "ethercat/esc/pdi.hpp"
#include "ethercat/master/channel.hpp"
#include "ethercat/master/setup.hpp"
#include "ethercat/wire/registers.hpp"

namespace {

using namespace hal::ethercat;

TEST(EthercatFrame, Reader_gives_back_what_the_writer_wrote) {
    std::array<std::uint8_t, max_frame_bytes> buffer{};
    FrameWriter writer(buffer, {2, 1, 2, 3, 4, 5});
    std::uint8_t* first = writer.add(Command::brd, 7, at_position(0, registers::al_status), 2);
    ASSERT_NE(first, nullptr);
    std::uint8_t* second = writer.add(Command::lrw, 8, 0x10000, 3);
    ASSERT_NE(second, nullptr);
    second[2] = 9;
    const auto frame = writer.finish();
    EXPECT_EQ(frame.size(), 60U);
    EXPECT_EQ(frame[14], 2 * 12 + 5) << "length of all datagrams";
    EXPECT_EQ(frame[15], 0x10) << "type of the header";

    FrameReader reader({buffer.data(), frame.size()});
    ASSERT_TRUE(reader.valid());
    const auto a = reader.next();
    const auto b = reader.next();
    ASSERT_TRUE(a && b);
    EXPECT_EQ(a->command, Command::brd);
    EXPECT_EQ(a->register_address(), registers::al_status);
    EXPECT_TRUE(a->more);
    EXPECT_EQ(b->index, 8);
    EXPECT_EQ(b->data[2], 9);
    EXPECT_FALSE(reader.next());
    EXPECT_FALSE(reader.malformed());
}

TEST(EthercatFrame, Datagram_beyond_the_frame_is_not_read) {
    std::array<std::uint8_t, max_frame_bytes> buffer{};
    FrameWriter writer(buffer, {});
    writer.add(Command::brd, 7, 0, 100);
    const auto frame = writer.finish();
    for (std::size_t length = 0; length < frame.size(); ++length) {
        FrameReader reader({buffer.data(), length});
        EXPECT_FALSE(reader.next()) << length;
    }
}

TEST(EthercatFrame, Writer_continues_a_complete_frame) {
    std::array<std::uint8_t, max_frame_bytes> buffer{};
    FrameWriter first(buffer, std::array<std::uint8_t, 6>{2, 1, 2, 3, 4, 5});
    first.add(Command::lrw, 7, 0x10000, 3)[1] = 9;
    ASSERT_EQ(first.finish().size(), 60U);
    FrameWriter more = FrameWriter::behind(buffer, 100);
    ASSERT_NE(more.add(Command::fprd, 7, at_station(0x1001, registers::al_status), 6), nullptr);
    EXPECT_EQ(more.add(Command::brd, 7, 0, 60), nullptr) << "100 bytes are full";
    const auto frame = more.finish();
    FrameReader reader({buffer.data(), frame.size()});
    const auto a = reader.next();
    const auto b = reader.next();
    ASSERT_TRUE(a && b);
    EXPECT_EQ(a->data[1], 9);
    EXPECT_TRUE(a->more);
    EXPECT_EQ(b->command, Command::fprd);
    EXPECT_EQ(b->register_address(), registers::al_status);
    EXPECT_FALSE(b->more);
    EXPECT_FALSE(reader.malformed());
}

using namespace hal::ethercat::master;
using hal::Task;

struct Two {
    Task<int> inner(Channel& channel, int by) {
        const Answer answer =
            co_await channel.exchange(Command::brd, at_position(0, registers::type), 1);
        co_return answer.wkc + by;
    }
    Task<> outer(Channel& channel, int& result) {
        result = co_await inner(channel, 10);
        result += co_await inner(channel, 100);
    }
};

TEST(EthercatTask, Nested_tasks_wait_for_their_datagrams_and_give_back_their_memory) {
    Channel channel;
    Two two;
    int result = 0;
    channel.start([&] { return two.outer(channel, result); });
    ASSERT_EQ(channel.stage(), Channel::Stage::waiting);
    channel.set_sent(0);
    channel.arrive(3);
    EXPECT_EQ(result, 13);
    channel.set_sent(0);
    channel.lose();
    EXPECT_EQ(channel.stage(), Channel::Stage::waiting) << "sent again";
    channel.set_sent(0);
    channel.arrive(4);
    EXPECT_EQ(result, 13 + 104);
    EXPECT_FALSE(channel.busy());
    // ends the previous one in its wait
    for (int i = 0; i < 1000; ++i) {
        channel.start([&] { return two.outer(channel, result); });
    }
    channel.stop();
}

}  // namespace
