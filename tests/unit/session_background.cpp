// SPDX-License-Identifier: MIT
// Work of components outside of the cycle: in step with the virtual clock, in a thread of its own
// on the real one.
#include "machine.hpp"

namespace hal::test {
namespace {

TEST(Background, Work_is_done_after_each_instant_of_the_virtual_clock) {
    Machine machine;
    machine.must(
        "newthread f 1000000\nnewthread s 2000000\nloadrt test-background names=a,b\naddf a "
        "f\naddf b s");
    machine.must("setp a.question 21\nsetp b.question 4");
    machine.start();
    machine.cycles(1);
    EXPECT_EQ(machine.number("a.turns"), 0) << "the first cycle has no answer yet";
    machine.cycles(1);
    EXPECT_EQ(machine.number("a.turns"), 1);
    EXPECT_EQ(machine.number("a.answer"), 42);
    EXPECT_EQ(machine.get("a.waits"), "FALSE");
    const auto first = machine.number("a.at");
    machine.cycles(100);
    EXPECT_EQ(machine.number("a.turns"), 101);
    EXPECT_EQ(machine.number("a.at"), first + 100'000'000);
    EXPECT_EQ(machine.number("b.answer"), 8) << "once for an instant, whichever threads ran in it";
    EXPECT_LE(machine.number("a.turns") - machine.number("b.turns"), 2);
}

TEST(Background, Work_ends_when_its_instance_goes_and_begins_when_one_comes) {
    Machine machine;
    machine.must("newthread f 1000000\nloadrt test-background names=a,b\naddf a f\naddf b f");
    machine.start();
    machine.cycles(10);
    machine.must("unloadrt a");
    machine.cycles(10);
    EXPECT_EQ(machine.number("b.turns"), 19);
    machine.must("loadrt test-background names=c\naddf c f");
    machine.cycles(10);
    EXPECT_EQ(machine.number("c.turns"), 9);
    EXPECT_EQ(machine.number("b.turns"), 29);
}

TEST(Background, Work_has_a_thread_of_its_own_on_the_real_clock) {
    Machine machine(Clock::real);
    machine.must(
        "newthread f 1000000\nloadrt test-background names=a\naddf a f\nsetp a.question 3");
    machine.start();
    EXPECT_TRUE(eventually([&] { return machine.number("a.answer") == 6; }));
    EXPECT_EQ(machine.get("a.waits"), "TRUE");
    machine.must("delf a f\nunloadrt a");  // which waits for its end
    EXPECT_EQ(machine.get("a.answer"), "?");
}

}  // namespace
}  // namespace hal::test
