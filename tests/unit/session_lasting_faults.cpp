// SPDX-License-Identifier: MIT
// Faults whose condition lasts: they are acknowledged when they are over.
#include "machine.hpp"
#include "plugins/watch.hpp"

namespace hal::test {
namespace {

struct LastingFaults : testing::Test {
    LastingFaults() {
        machine.must(
            "loadrt threads name1=t period1=1000000 name2=u period2=2000000\nloadrt test-faulty "
            "names=f\nloadrt test-counter names=c,d\naddf f.run t\naddf c t\naddf d u\nnet v "
            "f.value\nnet on f.on\nnet c-on c.on");
    }
    Machine machine;
};

TEST_F(LastingFaults, A_fault_that_lasts_is_acknowledged_only_when_it_is_over) {
    Reports& reports = machine.session.reports();
    machine.must("setp f.open 1");
    machine.start();
    machine.cycles(2);
    EXPECT_EQ(reports.fault_count(), 1u);
    const auto lasting = reports.clear_faults();
    ASSERT_EQ(lasting.size(), 1u);
    EXPECT_TRUE(lasting[0].lasts);
    EXPECT_EQ(lasting[0].subject(), "f: the cover is open");
    EXPECT_EQ(reports.fault_count(), 1u);
    EXPECT_EQ(reports.faults().size(), 1u) << "its record stays";
    machine.must("setp f.open 0");
    machine.cycles(2);
    EXPECT_EQ(reports.fault_count(), 1u) << "the end of the condition acknowledges nothing";
    EXPECT_FALSE(reports.faults()[0].lasts);
    EXPECT_TRUE(reports.clear_faults().empty());
    EXPECT_EQ(reports.fault_count(), 0u);
    EXPECT_TRUE(reports.faults().empty());
}

TEST_F(LastingFaults, Other_faults_are_acknowledged_beside_one_that_lasts) {
    Reports& reports = machine.session.reports();
    machine.must("setp f.open 1\nsetp f.raises 1");
    machine.start();
    machine.cycles(3);
    EXPECT_EQ(reports.fault_count(), 4u);
    machine.must("setp f.raises 0");
    EXPECT_EQ(reports.clear_faults().size(), 1u);
    EXPECT_EQ(reports.fault_count(), 1u);
    EXPECT_EQ(reports.lasting_count(), 1u);
}

TEST_F(LastingFaults, A_thread_that_an_exception_stopped_stays_a_fault_until_start) {
    Reports& reports = machine.session.reports();
    machine.must("setp f.throws 1");
    machine.start();
    machine.cycles(2);
    EXPECT_EQ(reports.clear_faults().size(), 1u);
    EXPECT_EQ(reports.fault_count(), 1u);
    machine.must("setp f.throws 0");
    machine.start();
    machine.cycles(2);
    EXPECT_EQ(reports.fault_count(), 1u);
    EXPECT_TRUE(reports.clear_faults().empty());
    EXPECT_EQ(reports.fault_count(), 0u);
}

TEST_F(LastingFaults, Not_a_number_stays_a_fault_while_it_lasts_and_across_an_edit) {
    Reports& reports = machine.session.reports();
    machine.must("setp f.bad-number 1");
    machine.start();
    machine.cycles(2);
    EXPECT_EQ(reports.clear_faults().size(), 1u);
    machine.must("loadrt test-counter names=e\naddf e t");
    machine.cycles(2);
    EXPECT_EQ(reports.clear_faults().size(), 1u);
    EXPECT_EQ(reports.fault_count(), 1u);
    machine.must("setp f.bad-number 0");
    machine.cycles(2);
    EXPECT_TRUE(reports.clear_faults().empty());
    EXPECT_EQ(reports.fault_count(), 0u);
}

TEST_F(LastingFaults, The_faults_of_an_instance_or_thread_that_is_gone_do_not_last) {
    Reports& reports = machine.session.reports();
    machine.must("setp f.open 1\nsetp f.throws 1");
    machine.start();
    machine.cycles(2);
    EXPECT_EQ(reports.lasting_count(), 1u) << "it threw before";
    machine.must("setp f.throws 0");
    machine.start();
    machine.cycles(2);
    EXPECT_EQ(reports.clear_faults().size(), 1u);
    machine.must("unloadrt f");
    EXPECT_EQ(reports.lasting_count(), 0u);
    EXPECT_TRUE(reports.clear_faults().empty());
    EXPECT_EQ(reports.fault_count(), 0u);
}

TEST(A_row_of_overruns, stays_a_fault_while_cycles_are_too_long) {
    Machine machine(Clock::real);
    machine.must("newthread t 20000000 budget=1ms\nloadrt test-faulty names=f\naddf f.run t");
    machine.start();
    machine.must("setp f.slow 3000");
    Reports& reports = machine.session.reports();
    ASSERT_TRUE(eventually([&] { return reports.threads()[0].over_budget >= 3; }));
    EXPECT_EQ(reports.clear_faults().size(), 1u);
    EXPECT_GE(reports.fault_count(), 1u);
    machine.must("setp f.slow 0");
    EXPECT_TRUE(
        eventually([&] { return reports.clear_faults().empty() && reports.fault_count() == 0; }));
}

TEST(A_hang, stays_a_fault_until_it_was_started_again) {
    static Watch watch;
    Machine machine(Clock::real);
    machine.must("newthread bad 1000000\nnewthread good 2000000\nloadrt test-life names=x " +
                 watch.argument() + "\naddf x bad\nloadrt test-counter names=c\naddf c good");
    machine.start();
    ASSERT_TRUE(eventually([&] { return watch.runs > 2; }));
    watch.hang = true;
    Reports& reports = machine.session.reports();
    ASSERT_TRUE(eventually([&] { return reports.threads()[0].hung; }));
    ASSERT_TRUE(eventually([&] { return reports.fault_count() == 1; }));
    const auto lasting = reports.clear_faults();
    ASSERT_EQ(lasting.size(), 1u);
    EXPECT_EQ(lasting[0].code, "hung-thread");
    EXPECT_EQ(reports.fault_count(), 1u);
    watch.hang = false;
    ASSERT_TRUE(eventually([&] { return !reports.threads()[0].hung; }));
    EXPECT_EQ(reports.clear_faults().size(), 1u) << "its functions are stopped";
    machine.start();
    EXPECT_TRUE(reports.clear_faults().empty());
    EXPECT_EQ(reports.fault_count(), 0u);
}

}  // namespace
}  // namespace hal::test
