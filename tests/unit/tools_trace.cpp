// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include "tools/trace/perfetto.hpp"
#include "tools/trace/sched.hpp"

namespace hal::tools {
namespace {

TEST(Message, numbers_and_texts_have_the_bytes_of_protobuf) {
    // the example of protobuf's encoding guide
    EXPECT_EQ(Message().number(1, 150).bytes(), "\x08\x96\x01");
    EXPECT_EQ(Message().text(2, "testing").bytes(), "\x12\x07testing");
    EXPECT_EQ(Message().message(3, Message().number(1, 150)).bytes(), "\x1a\x03\x08\x96\x01");
    EXPECT_EQ(Message().number(58, 0).bytes(), std::string("\xd0\x03\x00", 3));
    EXPECT_EQ(Message().number(1, ~std::uint64_t{0}).bytes().size(), 11u);
}

std::size_t count(const std::string& bytes, const std::string& part) {
    std::size_t found = 0;
    for (auto at = bytes.find(part); at != bytes.npos; at = bytes.find(part, at + 1)) {
        ++found;
    }
    return found;
}

TEST(PerfettoWriter, a_thread_is_described_once_and_a_name_interned_once) {
    PerfettoWriter writer;
    const std::string head = writer.begin("default", 7, {1, 2, 3});
    EXPECT_EQ(count(head, "hal default"), 1u);
    writer.name(5, "pid.do-pid-calcs");
    const TraceThread servo{"servo", 1'000'000, 8};
    const std::vector<ThreadEvent> cycle{{110, 120, 1, 5, ThreadEvent::function},
                                         {100, 130, 1, 10, ThreadEvent::cycle}};
    const std::string first = writer.events(servo, cycle, 0);

    const std::string second = writer.events(servo, cycle, 0);
    EXPECT_EQ(count(first, "pid.do-pid-calcs"), 1u);
    EXPECT_EQ(count(second, "pid.do-pid-calcs"), 0u);
    EXPECT_EQ(count(first, "overrun"), 0u);
    EXPECT_GT(first.size(), second.size());
}

TEST(PerfettoWriter, functions_wait_for_the_cycle_they_belong_to) {
    PerfettoWriter writer;
    writer.begin("default", 7, {});
    writer.name(5, "late-function");
    const TraceThread servo{"servo", 1000, 8};
    EXPECT_EQ(
        count(writer.events(servo, {{110, 120, 1, 5, ThreadEvent::function}}, 0), "late-function"),
        0u);
    const std::string bytes = writer.events(servo, {{100, 3000, 1, 10, ThreadEvent::cycle}}, 0);
    EXPECT_LT(bytes.find("cycle"), bytes.find("late-function"));
    EXPECT_EQ(count(bytes, "overrun"), 1u);
}

TEST(Switch, a_line_of_trace_pipe_is_read_with_names_that_have_blanks) {
    const auto one = read_switch(
        "          <idle>-0       [001] d..2.  1234.567890: sched_switch: prev_comm=swapper/1 "
        "prev_pid=0 prev_prio=120 prev_state=R ==> "
        "next_comm=my servo next_pid=77 next_prio=1");
    ASSERT_TRUE(one);
    EXPECT_EQ(one->cpu, 1);
    EXPECT_EQ(one->time_ns, 1234567890000);
    EXPECT_EQ(one->previous_name, "swapper/1");
    EXPECT_EQ(one->next_name, "my servo");
    EXPECT_EQ(one->next_tid, 77);
    EXPECT_EQ(one->next_priority, 1);
    EXPECT_EQ(one->previous_state, 0);
    EXPECT_FALSE(read_switch("CPU:1 [LOST 12 EVENTS]"));
    EXPECT_FALSE(read_switch("x [0] 1.0: sched_switch: prev_comm=a"));
    EXPECT_FALSE(read_switch(""));
}

}  // namespace
}  // namespace hal::tools
