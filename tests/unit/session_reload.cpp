// SPDX-License-Identifier: MIT
// Reloading: the versions are the same file here, so that whatever changes is the reload's doing.
// tests/cli/reload_test.py has others.
#include "machine.hpp"
#include "plugins/watch.hpp"

namespace hal::test {
namespace {

struct Reload : testing::Test {
    Reload() : machine(Clock::real) {
        machine.must("loadrt threads name1=fast period1=1000000 name2=slow period2=2000000\n");
    }
    Machine machine;
};

TEST_F(Reload, of_a_component_without_start_loses_and_doubles_no_cycle) {
    machine.must("loadrt test-counter names=a,b\naddf a fast\naddf b slow\nnet s a.sum => b.step");
    machine.start();
    ASSERT_TRUE(eventually([&] { return machine.number("a.count") > 3; }));
    const auto first = machine.get_all({"a.count", "fast.threadbeat"});
    for (int i = 0; i < 40; ++i) {
        machine.must("reload test-counter");
        const auto seen = machine.get_all({"a.count", "a.twin"});
        EXPECT_EQ(seen[0], seen[1]);
    }
    const auto last = machine.get_all({"a.count", "fast.threadbeat"});
    EXPECT_EQ(std::stoll(last[0]) - std::stoll(first[0]),
              std::stoll(last[1]) - std::stoll(first[1]))
        << "a run per cycle";
    EXPECT_EQ(machine.get("a.step"), "1");
    machine.must("unload test-counter");
}

TEST_F(Reload, of_a_component_that_starts_stops_the_old_one_first) {
    Watch watch;
    machine.must("loadrt test-life names=x " + watch.argument() +
                 "\naddf x fast\nnet l x.level\nsetp x.in TRUE");
    machine.start();
    ASSERT_TRUE(eventually([&] { return machine.get("x.out") == "TRUE"; }));
    machine.must("reload test-life");
    EXPECT_EQ(watch.constructed, 2);
    EXPECT_EQ(watch.started, 2);
    EXPECT_EQ(watch.stopped, 1);
    EXPECT_EQ(watch.destroyed, 1);
    EXPECT_GE(watch.emergencies, 1);
    const auto runs = watch.runs.load();
    ASSERT_TRUE(eventually([&] { return watch.runs > runs + 3; }));
    EXPECT_EQ(watch.max_inside, 1);
    EXPECT_EQ(machine.get("l"), "7");
    EXPECT_EQ(machine.get("x.in"), "TRUE");
    machine.must("unload test-life");
    EXPECT_EQ(watch.destroyed, 2);
}

TEST_F(Reload, in_an_edit_that_fails_elsewhere_is_rolled_back) {
    Watch watch;
    machine.must(
        "loadrt test-life names=x " + watch.argument() +
        "\naddf x fast\nloadrt test-counter names=c\nalias pin c.step pace\nsetp c.step 4");
    machine.rejected(
        "reload test-life\nreload test-counter\nreload test-counter\nsetp c.step nonsense",
        "bad-value");
    EXPECT_EQ(watch.started, 1);
    EXPECT_EQ(watch.constructed, watch.destroyed + 1);
    machine.start();
    EXPECT_TRUE(eventually([&] { return watch.runs > 3; }));
    machine.must("unload x");  // it writes to `watch`
}

TEST_F(Reload, and_other_edits_take_effect_together) {
    machine.must("loadrt test-counter names=a,b\naddf a fast\nsetp a.step 2\nnet s a.sum");
    machine.start();
    ASSERT_TRUE(eventually([&] { return machine.number("a.count") > 3; }));
    machine.must(
        "delf a fast\naddf a slow\nreload test-counter\nsetp b.step 5\naddf b slow\nnet s b.step");
    const auto count = machine.number("a.count");
    EXPECT_GT(count, 3);
    ASSERT_TRUE(eventually(
        [&] { return machine.number("a.count") > count + 3 && machine.number("b.count") > 3; }));
    EXPECT_EQ(machine.get("a.step"), "2");
    machine.must("reload test-counter\nreload test-counter\nsetp a.step 3");
    EXPECT_EQ(machine.get("a.step"), "3");
    machine.must("reload test-counter\nunload b");
    EXPECT_EQ(machine.get("b.count"), "?");
}

TEST_F(Reload, of_functions_in_two_threads_tears_nothing) {
    machine.must(
        "loadrt test-two names=w\naddf w.fast fast\naddf w.first slow\naddf w.last slow\nnet a w.a "
        "=> w.a-in w.a-again\nnet b w.b => w.b-in w.b-again");
    machine.start();
    ASSERT_TRUE(eventually([&] { return machine.number("w.looks") > 20; }));
    for (int i = 0; i < 20; ++i) {
        machine.must("reload test-two");
    }
    const auto looks = machine.number("w.looks");
    ASSERT_TRUE(eventually([&] { return machine.number("w.looks") != looks; }));
    EXPECT_EQ(machine.get("w.torn"), "0");
}

TEST_F(Reload, that_a_hung_thread_may_still_use_leaves_nothing_to_the_next_edit) {
    Watch hung;
    Watch starting;
    machine.must("loadrt test-counter names=c\naddf c fast\nloadrt test-life names=y " +
                 hung.argument() + "\naddf y slow");
    machine.start();
    ASSERT_TRUE(eventually([&] { return hung.runs > 2; }));
    starting.hang_at_start = &hung;
    EXPECT_FALSE(machine.edit("reload test-counter\nsetp c.step 5\nloadrt test-life names=z " +
                              starting.argument()));
    EXPECT_NE(machine.said.find("function 'y' (test-life) does not return [hung-thread]"),
              std::string::npos)
        << machine.said;
    EXPECT_EQ(starting.started, 1);
    EXPECT_EQ(starting.destroyed, 0) << "the edit is kept";
    hung.hang = false;
    ASSERT_TRUE(eventually([&] { return !machine.session.reports().threads()[1].hung; }));
    EXPECT_TRUE(machine.session.threads().start());
    EXPECT_EQ(machine.get("c.step"), "1");

    Pin* const step = machine.session.model().find_pin("c.step");
    EXPECT_TRUE(machine.session.threads().stop());  // the pin's thread reads it by plain moves
    machine.session.values().write({{step, hal_value{.real = 3.0}}});
    ASSERT_TRUE(eventually([&] { return machine.get("c.step") == "3"; }));
    EXPECT_FALSE(machine.edit("loadrt test-life names=w fail=start"));
    EXPECT_EQ(machine.get("c.step"), "3");
    machine.must("setp c.step 4\nunload test-life");
    EXPECT_EQ(machine.get("c.step"), "4");
}

TEST_F(Reload, and_new_threads_that_are_rejected_keep_the_plan_of_a_thread_that_does_not_end) {
    Watch hung;
    static Watch starting;  // the process keeps what a thread may still use
    machine.must("loadrt test-life names=y " + hung.argument() + "\naddf y slow");
    machine.start();
    ASSERT_TRUE(eventually([&] { return hung.runs > 2; }));
    starting.hang = true;
    starting.hang_at_start = &hung;
    EXPECT_FALSE(machine.edit("newthread extra 3000000\nloadrt test-life names=z " +
                              starting.argument() + "\naddf z extra"));
    ASSERT_TRUE(eventually([&] { return starting.hanging.load(); }));
    hung.hang = false;
    starting.hang = false;
    ASSERT_TRUE(eventually([&] { return !starting.hanging; }));
    const auto beat = machine.number("fast.threadbeat");
    ASSERT_TRUE(eventually([&] { return machine.number("fast.threadbeat") > beat + 20; }));
    ASSERT_TRUE(eventually([&] {
        return machine.edit("loadrt test-counter names=e\naddf e slow");
    })) << machine.said;
    machine.must("newthread extra 3000000\nunload test-life");
}

}  // namespace
}  // namespace hal::test
