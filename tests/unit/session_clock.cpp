// SPDX-License-Identifier: MIT
// The disciplined clock: one instance moves the deadlines of all threads together.
#include "machine.hpp"

namespace hal::test {
namespace {

struct DisciplinedThreads : testing::Test {
    DisciplinedThreads() {
        machine.must("newthread f 1000000\nnewthread s 4000000");
        machine.must("loadrt test-clock names=fast");
        machine.must("loadrt test-clock names=slow lead=0");
        machine.must("addf fast f\naddf slow s");
    }
    Machine machine;
};

TEST_F(DisciplinedThreads, An_adjustment_moves_only_later_cycles) {
    machine.start();
    machine.cycles(2);
    EXPECT_EQ(machine.number("fast.due"), 2'000'000);
    machine.must("setp fast.step 300");
    machine.cycles(1);
    EXPECT_EQ(machine.number("fast.due"), 3'000'000);
    machine.cycles(1);
    EXPECT_EQ(machine.number("fast.due"), 4'000'300);
    EXPECT_EQ(machine.number("fast.shift"), 600);
}

TEST_F(DisciplinedThreads, All_threads_keep_their_phase_to_one_another) {
    machine.must("setp fast.step -20000");
    machine.start();
    for (int turn = 1; turn <= 50; ++turn) {
        machine.cycles(4);
        // they are due at one position of the grid
        EXPECT_EQ(machine.number("slow.due"), machine.number("fast.due")) << turn;
        EXPECT_EQ(machine.number("fast.due"), 4'000'000 * turn - 20'000 * (4 * turn - 1));
    }
}

TEST_F(DisciplinedThreads, A_slow_thread_may_lead_a_fast_one) {
    machine.must("unloadrt fast\nunloadrt slow\nloadrt test-clock names=fast lead=0");
    machine.must("loadrt test-clock names=slow\naddf fast f\naddf slow s\nsetp slow.step 50000");
    machine.start();
    machine.cycles(4);
    EXPECT_EQ(machine.number("fast.due"), 4'000'000);
    machine.cycles(1);
    EXPECT_EQ(machine.number("fast.due"), 5'050'000);
    machine.cycles(3);
    EXPECT_EQ(machine.number("fast.due"), 8'050'000);
    EXPECT_EQ(machine.number("slow.due"), 8'050'000);
}

TEST_F(DisciplinedThreads, The_steps_of_a_cycle_are_at_most_a_tenth_of_the_fastest_period) {
    machine.start();
    machine.must("setp fast.step 2000000000\nsetp fast.again 2000000000");
    machine.cycles(3);
    EXPECT_EQ(machine.number("fast.limit"), 100'000);
    EXPECT_EQ(machine.number("fast.due"), 3'200'000);
    machine.must("setp fast.step -2000000000\nsetp fast.again -2000000000");
    machine.cycles(1);
    EXPECT_EQ(machine.number("fast.due"), 4'300'000);
    machine.cycles(1);
    EXPECT_EQ(machine.number("fast.due"), 5'200'000);
    machine.must("setp fast.step 70000\nsetp fast.again -30000");  // their sum counts
    machine.cycles(1);
    EXPECT_EQ(machine.number("fast.shift"), 140'000);
    machine.must("newthread faster 500000");
    machine.cycles(2);
    EXPECT_EQ(machine.number("fast.limit"), 50'000);
}

TEST_F(DisciplinedThreads, Threads_that_come_later_join_the_moved_grid) {
    machine.must("setp fast.step 1000");
    machine.start();
    machine.cycles(6);
    machine.must("setp fast.step 0");
    machine.must("newthread n 2000000\nloadrt test-clock names=new lead=0\naddf new n");
    machine.cycles(6);
    EXPECT_EQ(machine.number("fast.due"), 12'006'000);
    EXPECT_EQ(machine.number("new.due"), 12'006'000);
    machine.must("delthread s");
    machine.cycles(2);
    EXPECT_EQ(machine.number("new.due"), 14'006'000);
    EXPECT_EQ(machine.number("fast.backwards") + machine.number("new.backwards"), 0);
}

TEST_F(DisciplinedThreads, A_grid_that_goes_back_loses_no_cycle) {
    machine.must("setp fast.step -100000");
    machine.start();
    machine.session.threads().advance_ns(90'100'000);
    EXPECT_EQ(machine.number("fast.due"), 90'100'000);
    EXPECT_EQ(machine.number("fast.shift"), -10'000'000);
    EXPECT_EQ(machine.session.reports().threads()[0].cycles, 100u);
    EXPECT_EQ(machine.session.reports().threads()[1].cycles, 25u);
}

TEST_F(DisciplinedThreads, A_second_leader_is_rejected_with_the_name_of_the_first) {
    machine.rejected("loadrt test-clock names=other", "start-failed");
    EXPECT_NE(machine.said.find("'other' (test-clock) cannot start: the threads already follow the "
                                "clock of 'fast' (test-clock) [start-failed]"),
              std::string::npos)
        << machine.said;
    EXPECT_NE(machine.said.find("`clock = thread` in [bus] of an EtherCAT bus, `clock = own` of a "
                                "CANopen bus; or unload 'fast' first"),
              std::string::npos);
    machine.must("unloadrt fast");
    machine.must("loadrt test-clock names=other");
    EXPECT_EQ(machine.session.reports().clock()->leader, "other");
}

TEST_F(DisciplinedThreads, A_leader_may_be_exchanged_in_one_edit) {
    machine.must("setp fast.step 5000");
    machine.start();
    machine.cycles(10);
    machine.must("unloadrt fast\nloadrt test-clock names=other\naddf other f");
    machine.cycles(1);
    EXPECT_EQ(machine.number("other.due"), 11'050'000) << "the grid stays where it was brought to";
    EXPECT_EQ(machine.session.reports().clock()->leader, "other");
    machine.must("unloadrt other");
    EXPECT_FALSE(machine.session.reports().clock());
}

TEST_F(DisciplinedThreads, An_edit_that_is_rolled_back_claims_no_lead) {
    machine.must("unloadrt fast");
    EXPECT_FALSE(machine.edit("loadrt test-clock names=a\nloadrt test-clock names=b"));
    EXPECT_FALSE(machine.session.reports().clock());
    machine.must("loadrt test-clock names=a");
    EXPECT_TRUE(machine.session.reports().clock());
}

TEST_F(DisciplinedThreads, The_report_names_the_leader_the_offset_and_the_rate) {
    machine.must("setp fast.step 200");
    machine.start();
    machine.cycles(2500);
    const auto report = machine.session.reports().clock();
    ASSERT_TRUE(report);
    EXPECT_EQ(report->leader, "fast");
    EXPECT_EQ(report->shift_ns, 500'000);
    EXPECT_NEAR(report->rate, 200e-6, 1e-9);
}

/// Waits until each thread has run `count` more cycles. Returns false when one does not.
bool every_thread_runs(Machine& machine, std::uint64_t count) {
    const auto done = machine.session.reports().threads();
    return eventually([&] {
        const auto threads = machine.session.reports().threads();
        for (std::size_t i = 0; i < threads.size(); ++i) {
            if (threads[i].cycles < done[i].cycles + count) return false;
        }
        return true;
    });
}

TEST(DisciplinedRealThreads, Follow_adjustments_while_they_sleep_and_keep_their_phase) {
    Machine machine(Clock::real);
    // a host that is suspended stops no machine here: its threads' cycles would go on without the
    // functions
    machine.must(
        "newthread f 1000000 supervise=off\nnewthread s 20000000 supervise=off\n"
        "newthread ss 100000000 supervise=off\nloadrt test-clock names=fast");
    machine.must("loadrt test-clock names=slow lead=0");
    machine.must("loadrt test-clock names=slower lead=0");
    machine.must("addf fast f\naddf slow s\naddf slower ss");
    machine.must("setp fast.step -50000");
    machine.start();
    EXPECT_TRUE(eventually([&] { return machine.session.reports().threads()[2].cycles >= 4; }));
    machine.must("setp fast.step 0");
    // first the cycles that still adjust, in a thread that may be late, then the cycles compared;
    // a host that was suspended meanwhile has run no cycle, whatever time has passed
    EXPECT_TRUE(every_thread_runs(machine, 3));
    EXPECT_TRUE(every_thread_runs(machine, 3));
    // what was due last in each thread, brought back to the grid, is a multiple of the periods
    // apart
    const std::int64_t fast = machine.number("fast.due");
    const std::int64_t slow = machine.number("slow.due");

    const std::int64_t slower = machine.number("slower.due");
    EXPECT_EQ((fast - slow) % 1'000'000, 0);
    EXPECT_EQ((slow - slower) % 20'000'000, 0);
    EXPECT_LT(machine.number("fast.shift"), 0);
    EXPECT_EQ(machine.number("fast.backwards") + machine.number("slow.backwards") +
                  machine.number("slower.backwards"),
              0);
}

}  // namespace
}  // namespace hal::test
