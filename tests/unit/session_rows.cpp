// SPDX-License-Identifier: MIT
// Functions of one kind in a row are run by one loop of their plugin, without an observable
// difference.
#include <string>

#include "machine.hpp"

namespace hal::test {
namespace {

struct Rows : testing::Test {
    /// Ten in a chain within one thread, the first fed with 100.
    Rows() {
        std::string text =
            "loadrt threads name1=t period1=1000000\nloadrt test-row count=10\nloadrt test-counter "
            "names=c\n";
        for (int i = 0; i + 1 < 10; ++i) {
            text += "net n" + std::to_string(i) + " test-row." + std::to_string(i) +
                    ".out => test-row." + std::to_string(i + 1) + ".in\n";
        }
        text += "addf test-row.[0..9] t\nsetp test-row.0.in 100\n";
        machine.must(text);
    }
    Machine machine;
};

TEST_F(Rows, Run_in_the_order_in_which_they_stand) {
    machine.start();
    machine.cycles(1);
    EXPECT_EQ(machine.get("test-row.9.out"), "110") << "all in one cycle";
    EXPECT_EQ(machine.get("test-row.4.out"), "105");
}

TEST_F(Rows, Are_cut_where_another_function_stands) {
    machine.must("addf c t 6");  // in the middle
    machine.start();
    machine.cycles(3);
    EXPECT_EQ(machine.get("test-row.9.out"), "110");
    EXPECT_EQ(machine.get("c.count"), "3");
    machine.must("delf test-row.2 t\nsetp test-row.2.throws 1");
    machine.must("setp test-row.0.in 200");
    machine.cycles(1);
    EXPECT_EQ(machine.get("test-row.1.out"), "202");
    EXPECT_EQ(machine.get("test-row.2.out"), "103") << "it is in no thread any more";
    EXPECT_EQ(machine.get("test-row.9.out"), "110");
    EXPECT_EQ(machine.get("c.count"), "4");
}

TEST_F(Rows, A_fault_names_the_one_that_failed) {
    machine.must("addf c t");
    machine.start();
    machine.cycles(2);
    machine.must("setp test-row.6.throws 1\nsetp test-row.0.in 300");
    machine.cycles(1);
    const auto faults = machine.session.reports().faults();
    ASSERT_EQ(faults.size(), 1u);
    EXPECT_EQ(
        faults[0].sentence,
        "t: function 'test-row.6' (test-row) threw an exception at cycle 2; the thread's functions "
        "are stopped and its outputs were set to their safe values; see: show thread, start");
    EXPECT_EQ(machine.get("test-row.5.out"), "306");
    EXPECT_EQ(machine.get("test-row.6.out"), "107");
    EXPECT_EQ(machine.get("c.count"), "2");
}

}  // namespace
}  // namespace hal::test
