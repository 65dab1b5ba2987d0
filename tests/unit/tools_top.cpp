// SPDX-License-Identifier: MIT
#include "inspect/seen_instance.hpp"

#include <gtest/gtest.h>

namespace hal::tools {
namespace {

TEST(TopTest, reads_what_an_instance_says) {
    SeenInstance seen;
    ASSERT_TRUE(
        read_status("instance arm\nhost lab\npid 77\nrunning 1\nthread servo 1000000 12345 2 "
                    "0\nthread slow 10000000 1234 0 1\nfaults "
                    "3\nfault it broke\ncell line\nnode left\n",
                    seen));
    EXPECT_EQ(seen.instance + seen.host + seen.cell + seen.node, "armlablineleft");
    EXPECT_EQ(seen.pid, 77);
    ASSERT_EQ(seen.threads.size(), 2u);
    EXPECT_EQ(seen.threads[0].missed, 2u);
    EXPECT_TRUE(seen.threads[1].faulted);
    EXPECT_EQ(seen.faults, 3u);
    EXPECT_EQ(top_table({seen}),
              "INSTANCE         HOST         NODE                 THREAD            PERIOD       "
              "CYCLES   MISSED FAULTS\n"
              "arm              lab          line/left            servo               1 ms        "
              "12345        2      3\n"
              "                                                   slow               10 ms         "
              "1234        0         stopped by a fault\n"
              "                 newest fault: it broke\n");
}

TEST(TopTest, a_text_from_the_network_does_not_steer_the_terminal) {
    SeenInstance seen;
    EXPECT_FALSE(read_status("", seen));
    EXPECT_FALSE(read_status("thread\nthread a b\npid x\n\n\n", seen));
    ASSERT_TRUE(read_status(
        "instance \x1b[2Jbad\nfault " + std::string(5000, 'x') + "\nthread x -1 -2 -3 -4\n", seen));
    EXPECT_EQ(seen.instance, "\\x1b[2Jbad");
    EXPECT_LT(seen.fault.size(), 300u);
    // the control sequence introducer of 8 bits; a mark that turns the line round
    ASSERT_TRUE(
        read_status("instance a\xc2\x9b"
                    "2Jb\nhost \xe2\x80\xaezyx\n",
                    seen));
    EXPECT_EQ(seen.instance, "a\\xc2\\x9b2Jb");
    EXPECT_EQ(seen.host, "\\xe2\\x80\\xaezyx");
    std::string many = "instance a\n";
    for (int i = 0; i < 1000; ++i) {
        many += "thread t 1 1 1 0\n";
    }
    SeenInstance flood;
    ASSERT_TRUE(read_status(many, flood));
    EXPECT_EQ(flood.threads.size(), 100u);
}

TEST(TopTest, json_has_all_of_it_and_survives_broken_utf8) {
    SeenInstance seen;
    ASSERT_TRUE(read_status("instance a\xff\npid 1\nthread servo 1000000 5 0 0\n", seen));
    const std::string text = top_json({seen});
    EXPECT_NE(text.find("\"cycles\":5"), std::string::npos) << text;
    EXPECT_EQ(top_json({}), "[]\n");
}

TEST(TopTest, a_narrow_table_leaves_out_what_is_the_same_everywhere) {
    SeenInstance one;
    ASSERT_TRUE(
        read_status("instance lathe\nhost lab\nrunning 1\nthread servo 1000000 5 0 0\n", one));
    SeenInstance other = one;
    other.instance = "mill";
    const auto narrow = top_lines({one, other}, 80);
    EXPECT_EQ(narrow[0], "INSTANCE         THREAD            PERIOD       CYCLES   MISSED FAULTS");
    EXPECT_EQ(narrow[1], "lathe            servo               1 ms            5        0      0");
    const auto narrower = top_lines({one, other}, 50);
    EXPECT_EQ(narrower[0], "INSTANCE THREAD PERIOD CYCLES   MISSED FAULTS");
    other.host = "hall";
    EXPECT_NE(top_lines({one, other}, 80)[0].find("HOST"), std::string::npos);
    other.node = "left";
    other.cell = "line";
    EXPECT_NE(top_lines({one, other}, 80)[2].find("line/left"), std::string::npos);
}

TEST(TopTest, reports_offline_instances_and_an_empty_list) {
    EXPECT_EQ(top_table({}), "no instance is running; start one: hal run FILE.hal\n");
    SeenInstance gone;
    ASSERT_TRUE(read_status("instance a\nrunning 1\n", gone));
    gone.silent_s = 7;
    EXPECT_NE(top_table({gone}).find("offline for 7 s"), std::string::npos);
}

}  // namespace
}  // namespace hal::tools
