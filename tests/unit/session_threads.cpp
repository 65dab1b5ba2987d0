// SPDX-License-Identifier: MIT
// LinuxCNC's rules of functions, threads, loading and starting, on the virtual clock.
#include "machine.hpp"
#include "plugins/watch.hpp"

namespace hal::test {
namespace {

std::string row(const Machine& machine, const char* thread) {
    std::string names;
    for (const LoadedFunction* function : machine.session.model().find_thread(thread)->functions) {
        names += (names.empty() ? "" : " ") + function->name;
    }
    return names;
}

struct Threads : testing::Test {
    Threads() {
        machine.must("loadrt threads name1=t period1=1000000\nloadrt test-counter names=a,b,c,d\n");
    }
    Machine machine;
};

TEST_F(Threads, Addf_places_functions_by_position) {
    machine.must("addf a t\naddf b t 1\naddf c t -1\naddf d t 2");
    EXPECT_EQ(row(machine, "t"), "b d a c");
    machine.must("delf d t\naddf d t -2");
    EXPECT_EQ(row(machine, "t"), "b a d c");
    machine.must("delf d t\naddf d t +4");
    EXPECT_EQ(row(machine, "t"), "b a c d");
    machine.must("delf d t\naddf d t -4");
    EXPECT_EQ(row(machine, "t"), "d b a c");
}

TEST_F(Threads, Addf_rejects_invalid_positions) {
    machine.must("addf a t\naddf b t");
    for (const char* position : {"0", "4", "-4", "x", "1.5", "99999999999999999999"}) {
        machine.rejected(std::string("addf c t ") + position, "bad-position");
    }
}

TEST_F(Threads, A_function_is_in_one_thread_once) {
    machine.must("newthread u 2000000\naddf a t");
    machine.rejected("addf a t", "function-in-thread");
    machine.rejected("addf a u", "function-in-thread");
    machine.rejected("initf a t", "function-in-thread");
    machine.must("delf a t\naddf a u");
    machine.rejected("delf a t", "not-in-thread");
    machine.rejected("delf b t", "not-in-thread");
}

TEST_F(Threads, Unknown_names_are_rejected) {
    machine.rejected("addf nothing t", "no-such-function");
    machine.rejected("addf a nothing", "no-such-thread");
    machine.rejected("delf nothing t", "no-such-function");
    machine.rejected("delthread nothing", "no-such-thread");
    machine.rejected("loadrt nothing", "no-such-component");
    machine.rejected("unloadrt nothing", "no-such-component");
    machine.rejected("addf a t 1 2", "wrong-arguments");
}

TEST_F(Threads, Functions_run_in_order_and_a_later_reader_sees_the_same_cycle) {
    machine.must("addf a t\naddf b t\nnet s a.sum => b.step");
    machine.start();
    machine.cycles(3);
    EXPECT_EQ(machine.get("b.sum"), "6");  // 1 + 2 + 3
}

TEST_F(Threads, An_earlier_reader_sees_the_cycle_before) {
    machine.must("addf b t\naddf a t\nnet s a.sum => b.step\nsetp a.step 1");
    machine.start();
    machine.cycles(3);
    EXPECT_EQ(machine.get("b.sum"), "3");  // 0 + 1 + 2
}

TEST_F(Threads, Another_threads_value_is_its_last_finished_cycle) {
    machine.must(
        "newthread slow 4000000\naddf a t\naddf b slow\nnet s a.sum => b.step\nnet r b.sum => "
        "c.step\naddf c t");
    machine.start();
    // at 4 ms the fast thread has run for the fourth time when the slow one starts
    machine.cycles(4);
    EXPECT_EQ(machine.get("b.sum"), "4");
    EXPECT_EQ(machine.get("c.sum"), "0");  // it ran before the slow thread in each of the four
    machine.cycles(1);
    EXPECT_EQ(machine.get("c.sum"), "4");
}

TEST_F(Threads, Functions_get_the_nominal_period) {
    machine.must("newthread slow 5000000\naddf a t\naddf b slow");
    machine.start();
    machine.cycles(10);
    EXPECT_EQ(machine.get("a.period"), "1000000");
    EXPECT_EQ(machine.get("b.period"), "5000000");
    EXPECT_EQ(machine.get("a.count"), "10");
    EXPECT_EQ(machine.get("b.count"), "2");
}

TEST_F(Threads, A_period_is_rounded_to_a_multiple_of_the_fastest_with_a_warning) {
    machine.must("newthread slow 2600000");
    EXPECT_EQ(machine.session.model().find_thread("slow")->options.period_ns, 3000000);
    EXPECT_NE(machine.said.find("[period-multiple]"), std::string::npos);
}

TEST_F(Threads, A_new_fastest_thread_must_divide_all_others) {
    machine.must("newthread slow 3000000");
    machine.rejected("newthread fast 700000", "period-multiple");
    machine.must("newthread fast 500000");
    EXPECT_EQ(machine.session.model().threads.front()->name, "fast");
}

TEST_F(Threads, Invalid_periods_are_rejected) {
    for (const char* period : {"0", "999", "-1000000", "x", "1e99"}) {
        machine.rejected(std::string("newthread u ") + period, "bad-period");
    }
    machine.rejected("newthread t 1000000", "name-taken");
    machine.rejected("newthread u 1000000 cpu=x", "bad-argument");
    machine.rejected("newthread u 1000000 colour=red", "unknown-argument");
    machine.rejected("loadrt threads name1=u periodx=7", "unknown-argument");
}

TEST_F(Threads, Loadrt_threads_can_be_given_again) {
    machine.must("loadrt threads name1=u period1=2000000 name2=v period2=4000000");
    EXPECT_NE(machine.session.model().find_thread("u"), nullptr);
    EXPECT_NE(machine.session.model().find_thread("v"), nullptr);
    EXPECT_EQ(machine.session.model().find_component("threads")->arguments.size(), 2u);
}

TEST_F(Threads, Threads_wake_before_start_but_run_no_function) {
    machine.must("addf a t");
    machine.cycles(5);
    EXPECT_EQ(machine.get("a.count"), "0");
    EXPECT_EQ(machine.get("t.threadbeat"), "5");
    machine.start();
    machine.cycles(5);
    machine.stop();
    machine.cycles(5);
    EXPECT_EQ(machine.get("a.count"), "5");
    EXPECT_EQ(machine.get("t.threadbeat"), "15");
    machine.start();
    machine.cycles(1);
    EXPECT_EQ(machine.get("a.count"), "6");
}

TEST_F(Threads, Stop_writes_safe_values_and_start_goes_on) {
    machine.must("addf a t\nnet s a.on");
    machine.start();
    machine.cycles(2);
    EXPECT_EQ(machine.get("s"), "TRUE");
    machine.stop();
    EXPECT_EQ(machine.get("s"), "FALSE");
    EXPECT_EQ(machine.get("a.count"), "2");  // no safe value declared: it stays
    machine.start();
    machine.cycles(1);
    EXPECT_EQ(machine.get("s"), "TRUE");
}

TEST_F(Threads, Initf_runs_once_in_a_cycle_of_its_own) {
    machine.must("initf a t\naddf b t");
    machine.cycles(3);
    EXPECT_EQ(machine.get("a.count"), "0");
    machine.start();
    machine.cycles(1);
    EXPECT_EQ(machine.get("a.count"), "1");
    EXPECT_EQ(machine.get("b.count"), "0");
    machine.cycles(4);
    machine.stop();
    machine.start();
    machine.cycles(1);
    EXPECT_EQ(machine.get("a.count"), "1");
    EXPECT_EQ(machine.get("b.count"), "5");
    machine.rejected("initf c t", "init-done");
}

TEST_F(Threads, Time_pins_of_threads_and_functions_link_and_set_like_others) {
    machine.must(
        "addf a t\nnet ticks t.threadbeat\nnewsig n s32\nlinkps a.time n\nsetp a.tmax 5\nsetp "
        "t.tmax 7");
    machine.start();
    machine.cycles(3);
    EXPECT_EQ(machine.get("ticks"), "3");
    EXPECT_EQ(machine.get("a.tmax"), "5");  // the virtual clock measures nothing
    EXPECT_EQ(machine.get("t.tmax"), "7");
    machine.rejected("setp t.threadbeat 0", "output-set");
    machine.rejected("net m t.tmax", "parameter-link");
    for (const char* pin :
         {"t.time", "t.tmax-increased", "t.missed", "t.wakeup", "a.tmax-increased"}) {
        EXPECT_NE(machine.get(pin), "?") << pin;
    }
}

TEST_F(Threads, Delthread_frees_its_functions_and_keeps_values) {
    machine.must("addf a t\nnet s a.sum\nnewthread u 2000000");
    machine.start();
    machine.cycles(4);
    machine.must("delthread t");
    EXPECT_EQ(machine.get("s"), "4");
    EXPECT_EQ(machine.get("a.count"), "4");
    EXPECT_EQ(machine.get("a.on"), "FALSE");
    EXPECT_EQ(machine.get("t.time"), "?");
    machine.must("addf a u");
    machine.cycles(1);
    EXPECT_EQ(machine.get("s"), "5");
}

TEST_F(Threads, A_function_moved_between_threads_keeps_its_state) {
    machine.must("newthread u 2000000\naddf a t\nnet s a.sum => b.step\naddf b t");
    machine.start();
    machine.cycles(4);
    machine.must("delf a t\naddf a u");
    machine.cycles(4);
    EXPECT_EQ(machine.get("s"), "6");
    machine.must("delf a u\naddf a t 1");
    machine.cycles(4);
    EXPECT_EQ(machine.get("s"), "10");
    EXPECT_EQ(machine.get("a.count"), "10");
}

TEST_F(Threads, A_virtual_run_is_the_same_every_time) {
    const auto run = [] {
        Machine one;
        one.must(
            "loadrt threads name1=f period1=250000 name2=s period2=1000000\nloadrt test-counter "
            "names=a,b\naddf a f\naddf b s\n"
            "net x a.sum => b.step\nnet y b.sum => a.step");
        one.start();
        one.cycles(1000);
        return one.dump();
    };
    EXPECT_EQ(run(), run());
}

// --- instances -----------------------------------------------------------------------------------------------------------

TEST(Instances, are_numbered_named_and_added_at_any_time) {
    Machine machine;
    machine.must("loadrt test-counter count=2");
    machine.must("loadrt test-counter");
    machine.must("loadrt test-counter names=left,right");
    machine.must("loadrt test_counter num_chan=1");
    for (const char* name : {"test-counter.0", "test-counter.1", "test-counter.2", "left", "right",
                             "test-counter.3"}) {
        EXPECT_NE(machine.session.model().find_instance(name), nullptr) << name;
    }
    EXPECT_EQ(machine.session.model().components.size(), 1u);
    machine.rejected("loadrt test-counter names=left", "name-taken");
    machine.rejected("loadrt test-counter names=x,,y", "bad-argument");
    machine.rejected("loadrt test-counter count=0", "bad-argument");
    machine.rejected("loadrt test-counter count=1 names=x", "names-and-count");
    machine.rejected("loadrt test-counter coutn=1", "unknown-argument");
    machine.rejected("loadrt test-counter word", "bad-argument");
    machine.must("loadrt test-counter");
    EXPECT_NE(machine.session.model().find_instance("test-counter.4"), nullptr)
        << "a rejected load takes no number";
}

TEST(Instances, of_a_singleton_are_one) {
    Machine machine;
    machine.must("loadrt test-single");
    EXPECT_NE(machine.session.model().find_pin("test-single.runs"), nullptr);
    machine.rejected("loadrt test-single", "name-taken");
    Machine other;
    other.rejected("loadrt test-single count=2", "bad-argument");
}

TEST(Instances, get_arguments_personalities_and_lists) {
    Machine machine;
    machine.must(
        "loadrt threads\nloadrt test-shared count=3 kind=4,5,6 gain=2.5 personality=7,8\naddf "
        "test-shared.update thread1");
    machine.start();
    machine.cycles(1);
    EXPECT_EQ(machine.get("test-shared.0.kind"), "4");
    EXPECT_EQ(machine.get("test-shared.2.kind"), "6");
    EXPECT_EQ(machine.get("test-shared.1.gain"), "2.5");
    EXPECT_EQ(machine.get("test-shared.0.personality"), "7");
    EXPECT_EQ(machine.get("test-shared.1.personality"), "8");
    EXPECT_EQ(machine.get("test-shared.2.personality"), "7");
    machine.rejected("loadrt test-shared kind=x", "bad-argument");
    machine.rejected("loadrt test-shared gain=much", "bad-argument");
    machine.rejected("loadrt test-shared personality=101", "construct-failed");
    machine.rejected("loadrt test-shared count=2 kind=1,2,3", "bad-argument");
    machine.rejected("loadrt test-shared gain=1 gain=2", "bad-argument");
}

TEST(Instances, are_as_many_as_a_list_argument_has_values) {
    Machine machine;
    machine.must("loadrt test-shared kind=1,2,3,4");
    EXPECT_EQ(machine.session.model().find_component("test-shared")->instances.size(), 4u);
    EXPECT_EQ(machine.session.model().find_function("test-shared.update")->steps.size(), 4u);
}

TEST(A_shared_function, runs_all_instances_in_order_and_those_loaded_later_too) {
    Machine machine;
    machine.must("loadrt threads\nloadrt test-shared count=2\naddf test-shared.update thread1");
    machine.start();
    machine.cycles(1);
    const auto first = machine.number("test-shared.0.place");
    EXPECT_EQ(machine.number("test-shared.1.place"), first + 1);
    machine.must("loadrt test-shared");
    machine.cycles(1);
    EXPECT_EQ(machine.number("test-shared.0.place"), first + 2);
    EXPECT_EQ(machine.number("test-shared.2.place"), first + 4);
    machine.must("unloadrt test-shared.1");
    machine.cycles(1);
    EXPECT_EQ(machine.number("test-shared.2.place"), first + 6);
    machine.must("unloadrt test-shared.0\nunloadrt test-shared.2");
    EXPECT_EQ(machine.session.model().find_function("test-shared.update"), nullptr);
    EXPECT_EQ(row(machine, "thread1"), "");
}

TEST(Functions_of_one_instance, spread_over_threads_only_when_each_has_its_own_pins) {
    Machine machine;
    machine.must(
        "loadrt threads name1=t period1=1000000 name2=u period2=2000000\nloadrt test-two "
        "names=free\nloadrt test-two names=tied common=1");
    machine.must("addf free.fast t\naddf free.first u\naddf free.last u");
    machine.rejected("addf tied.fast t\naddf tied.first u", "spread-pins");
}

TEST(An_instance, lives_from_construct_to_destroy_in_order) {
    Watch watch;
    Machine machine;
    machine.must("loadrt threads\nloadrt test-life names=x " + watch.argument() +
                 "\naddf x thread1");
    EXPECT_EQ(watch.constructed, 1);
    EXPECT_EQ(watch.started, 1);
    machine.start();
    machine.cycles(3);
    EXPECT_EQ(watch.runs, 3u);
    machine.must("unloadrt x");
    EXPECT_EQ(watch.stopped, 1);
    EXPECT_EQ(watch.destroyed, 1);
    EXPECT_GE(watch.emergencies, 1);
    EXPECT_TRUE(machine.session.model().find_component("test-life") == nullptr)
        << "the plugin goes with its last instance";
}

TEST(An_unloaded_instance, leaves_safe_values_in_the_signals_it_drove) {
    Watch watch;
    Machine machine;
    machine.must("loadrt threads\nloadrt test-life names=x " + watch.argument() +
                 "\nloadrt test-counter names=c\naddf x thread1\naddf c thread1\nnet level x.level "
                 "=> c.step\nnet out x.out");
    machine.start();
    machine.cycles(3);
    EXPECT_EQ(machine.get("level"), "7");
    EXPECT_EQ(machine.get("out"), "FALSE");
    machine.must("unloadrt x");
    EXPECT_EQ(machine.get("level"), "-1");
    EXPECT_EQ(machine.get("c.step"), "-1");
    EXPECT_EQ(machine.get("out"), "TRUE");
}

TEST(Unload_all, takes_everything_back) {
    Watch watch;
    Machine machine;
    const std::string empty = machine.dump();
    machine.must("loadrt threads\nloadrt test-life count=3 " + watch.argument() +
                 "\nloadrt test-counter\naddf test-counter.0 thread1\naddf test-life.1 thread1");
    machine.start();
    machine.cycles(2);
    machine.must("unloadrt all");
    EXPECT_EQ(machine.dump(), empty);
    EXPECT_EQ(watch.destroyed, 3);
}

TEST(A_session, stops_and_destroys_the_remaining_instances_when_it_ends) {
    Watch watch;
    {
        Machine machine;
        machine.must("loadrt threads\nloadrt test-life count=3 " + watch.argument() +
                     "\naddf test-life.1 thread1");
        machine.start();
        machine.cycles(2);
    }
    EXPECT_EQ(watch.stopped, 3);
    EXPECT_EQ(watch.destroyed, 3);
    EXPECT_GE(watch.emergencies, 1);
}

TEST(Check_only, constructs_and_starts_nothing) {
    Watch watch;
    SessionOptions options;
    options.check_only = true;
    options.plugin_path = {HALCYON_TEST_PLUGINS};
    {
        Session session(options);
        Diagnostics diagnostics;
        const auto source =
            session.sources.add("x", "loadrt threads\nloadrt test-life fail=start " +
                                         watch.argument() + "\naddf test-life.0 thread1\n");
        Transaction transaction = session.begin();
        for (const Command& command : parse(session.sources, source, {}, diagnostics)) {
            apply_edit(transaction, command, diagnostics);
        }
        EXPECT_TRUE(transaction.commit(diagnostics)) << render(diagnostics, session.sources);
        EXPECT_EQ(watch.constructed, 1);
        EXPECT_EQ(watch.started, 0);
    }
    EXPECT_EQ(watch.stopped, 0);
    EXPECT_EQ(watch.destroyed, 1);
}

TEST(Auto_order, puts_writers_before_readers_and_reports_where_it_cut_a_loop) {
    Machine machine;
    machine.must(
        "loadrt threads name1=t period1=1000000\nloadrt test-counter names=a,b,c\nnet x c.sum => "
        "b.step\nnet y b.sum => a.step");
    machine.must("addf --auto t");
    EXPECT_EQ(row(machine, "t"), "c b a");
    machine.must("delf a t\ndelf b t\ndelf c t\nnet z a.sum => c.step");
    machine.must("addf --auto t a b c");
    EXPECT_NE(machine.said.find("[cyclic-order]"), std::string::npos) << machine.said;
    EXPECT_EQ(machine.session.model().find_thread("t")->functions.size(), 3u);
    machine.rejected("addf --auto t", "no-such-function");
}

}  // namespace
}  // namespace hal::test
