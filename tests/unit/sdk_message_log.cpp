// SPDX-License-Identifier: MIT
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "hal/message_log.hpp"

using hal::MessageLog;

namespace {

constexpr std::int64_t ms = 1'000'000;

struct MessageLogTest : testing::Test {
    std::vector<std::string> lines;
    MessageLog log{"it.0", [this](const std::string& line) { lines.push_back(line); }};
    using Lines = std::vector<std::string>;
};

TEST_F(MessageLogTest, First_message_of_each_subject_is_printed_at_once) {
    log.print("5", "node 5 is lost", 0);
    log.print("6", "node 6 is lost", 0);
    EXPECT_EQ(lines, (Lines{"it.0: node 5 is lost\n", "it.0: node 6 is lost\n"}));
}

TEST(MessageLogOfAProgram, Each_line_has_the_time_of_what_it_reports) {
    std::vector<std::string> lines;
    MessageLog log{hal::LinePrefix::time_since(1000 * ms),
                   [&lines](const std::string& line) { lines.push_back(line); }};
    log.print("a", "first", 1001 * ms);
    log.print("a", "second", 1500 * ms);
    log.flush(2600 * ms);
    EXPECT_EQ(lines, (std::vector<std::string>{"    0.001 s  first\n", "    0.500 s  second\n"}));
}

TEST_F(MessageLogTest, Storm_is_one_line_per_second_with_the_newest_message_and_a_count) {
    for (int i = 0; i < 3000; ++i) {
        log.print("storm", "latency " + std::to_string(i) + " us", i * ms);
    }
    EXPECT_EQ(lines, (Lines{"it.0: latency 0 us\n", "it.0: latency 999 us (999 times in 1.0 s)\n",
                            "it.0: latency 1999 us (1000 times in 1.0 s)\n"}));
    log.flush(3000 * ms);
    EXPECT_EQ(lines.size(), 4u);
    EXPECT_EQ(lines.back(), "it.0: latency 2999 us (1000 times in 1.0 s)\n");
    log.flush(4000 * ms);
    log.print("storm", "latency 1 us", 4500 * ms);
    EXPECT_EQ(lines.back(), "it.0: latency 1 us\n")
        << "after a quiet second it is printed at once again";
    EXPECT_EQ(lines.size(), 5u);
}

TEST_F(MessageLogTest, One_repetition_has_no_count) {
    log.print("a", "x", 0);
    log.print("a", "x", 10 * ms);
    log.flush(500 * ms);
    EXPECT_EQ(lines.size(), 1u);
    log.flush(1000 * ms);
    EXPECT_EQ(lines, (Lines{"it.0: x\n", "it.0: x\n"}));
}

TEST_F(MessageLogTest, Alternating_states_keep_their_order) {
    log.print("lost", "lost", 0);
    log.print("back", "back", 100 * ms);
    log.print("lost", "lost", 200 * ms);
    log.print("back", "back", 300 * ms);
    for (int i = 300; i < 2000; ++i) {
        log.flush(i * ms);
    }
    EXPECT_EQ(lines, (Lines{"it.0: lost\n", "it.0: back\n", "it.0: lost\n", "it.0: back\n"}));
}

TEST_F(MessageLogTest, What_was_counted_is_printed_before_news_about_another_subject) {
    log.print("frozen", "frozen", 0);
    log.print("good", "good again", 100 * ms);
    log.print("frozen", "frozen", 200 * ms);
    log.print("good", "good again", 300 * ms);
    log.print("gone", "unplugged", 400 * ms);
    EXPECT_EQ(lines, (Lines{"it.0: frozen\n", "it.0: good again\n", "it.0: frozen\n",
                            "it.0: good again\n", "it.0: unplugged\n"}));
}

TEST_F(MessageLogTest, Without_a_subject_numbers_do_not_count) {
    log.print("no frame for 1.5 s", 0);
    log.print("no frame for 12 s", 1 * ms);
    EXPECT_EQ(lines.size(), 1u);
    EXPECT_EQ(MessageLog::without_numbers("can0: 0x1F is 1.5 s, 12."), "can#: # is # s, #.");
    EXPECT_EQ(MessageLog::without_numbers("'cell' (010f44aa5e) of 02:00:5e:0a, after 5us"),
              "'cell' (#) of #:#:#:#, after #us");
}

TEST_F(MessageLogTest, Subjects_beyond_the_limit_are_counted) {
    for (int i = 0; i < 100'000; ++i) {
        log.print(std::to_string(i), "subject " + std::to_string(i), 0);
    }
    EXPECT_EQ(lines.size(), MessageLog::max_subjects);
    log.flush(1000 * ms);
    ASSERT_EQ(lines.size(), MessageLog::max_subjects + 1);
    EXPECT_EQ(lines.back(), "it.0: 99744 messages about further subjects not shown\n");
}

// What a device chooses, such as an error code, may be different every time.
TEST_F(MessageLogTest,
       Storm_of_one_kind_with_ever_other_details_is_a_few_lines_and_one_per_second) {
    for (int i = 0; i < 3000; ++i) {
        log.print(hal::MessageSubject{"emergency 3", std::to_string(i)},
                  "node 3: emergency " + std::to_string(i), i * ms);
    }
    ASSERT_EQ(lines.size(), MessageLog::max_details + 2);
    EXPECT_EQ(lines[0], "it.0: node 3: emergency 0\n");
    EXPECT_EQ(lines[MessageLog::max_details - 1], "it.0: node 3: emergency 7\n");
    EXPECT_EQ(lines[MessageLog::max_details],
              "it.0: node 3: emergency 1007 (999 similar messages in 1.0 s not shown)\n");
    EXPECT_EQ(lines.back(),
              "it.0: node 3: emergency 2007 (999 similar messages in 1.0 s not shown)\n");
    log.close();
    EXPECT_EQ(lines.back(),
              "it.0: node 3: emergency 2999 (991 similar messages in 1.0 s not shown)\n");
}

TEST_F(MessageLogTest, Storm_of_one_kind_does_not_hide_another) {
    for (int i = 0; i < 500; ++i) {
        log.print(hal::MessageSubject{"emergency 3", std::to_string(i)}, "node 3: emergency",
                  i * ms);
    }
    log.print(hal::MessageSubject{"lost 4", ""}, "node 4 is lost", 500 * ms);
    EXPECT_EQ(lines.back(), "it.0: node 4 is lost\n");
}

TEST_F(MessageLogTest, Storm_of_one_kind_ends_with_a_quiet_second) {
    const auto print = [&](int detail, std::int64_t at) {
        log.print(hal::MessageSubject{"k", std::to_string(detail)}, "k " + std::to_string(detail),
                  at);
    };
    for (int i = 0; i < 20; ++i) {
        print(i, i * ms);
    }
    log.flush(1100 * ms);
    log.flush(2200 * ms);
    const std::size_t before = lines.size();
    print(100, 2300 * ms);
    print(101, 2301 * ms);
    EXPECT_EQ(lines.size(), before + 2);
}

TEST_F(MessageLogTest, Endless_subjects_get_few_lines_after_the_first_second) {
    for (int i = 0; i < 5000; ++i) {
        log.print(std::to_string(i), "subject", i * ms);
    }
    EXPECT_LE(lines.size(),
              MessageLog::max_subjects + 5 * (MessageLog::max_subjects_of_a_storm + 1));
}

TEST_F(MessageLogTest, Lines_go_to_the_journal_of_the_machine_while_it_is_set) {
    Lines kept;
    const hal_messages journal{sizeof journal,
                               [](const hal_messages* self, const char* line, std::size_t bytes) {
        static_cast<Lines*>(self->data)->emplace_back(line, bytes);
    }, &kept};
    log.print("before", 0);
    log.journal(&journal);
    log.print("node # is lost", "node 3 is lost", 0);
    log.print("node # is lost", "node 4 is lost", 100 * ms);
    log.flush(1200 * ms);
    log.journal(nullptr);
    log.print("after", 3000 * ms);
    EXPECT_EQ(kept, (Lines{"it.0: node 3 is lost", "it.0: node 4 is lost"}));
    EXPECT_EQ(lines.size(), 4u);
}

TEST_F(MessageLogTest, Close_prints_what_was_only_counted) {
    for (int i = 0; i < 5; ++i) {
        log.print("a", "x", i * 100 * ms);
    }
    log.close();
    EXPECT_EQ(lines.back(), "it.0: x (4 times in 0.4 s)\n");
    log.close();
    EXPECT_EQ(lines.size(), 2u);
}

}  // namespace
