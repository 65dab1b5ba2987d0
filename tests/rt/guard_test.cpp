// SPDX-License-Identifier: MIT
// The guard itself: what must not happen in a cycle is caught in a plugin, and only there.
#include "rt/guard.hpp"
#include "unit/machine.hpp"

namespace hal::test {
namespace {

struct Guard : testing::TestWithParam<const char*> {
    Guard() {
        GTEST_FLAG_SET(death_test_style, "threadsafe");
        machine.must("newthread t 1000000\nloadrt test-faulty names=f\naddf f.run t");
        machine.start();
        machine.cycles(10);
    }
    Machine machine;
};

TEST_P(Guard, catches_a_component_that) {
    if (!guarded) {
        GTEST_SKIP() << "this sanitizer needs the calls for itself";
    }
    machine.must(std::string("setp f.") + GetParam() + " 1");
#ifdef HALCYON_RT_GUARD
    EXPECT_DEATH(machine.cycles(1),
                 "intercepted call to real-time unsafe function `[a-z_]+` in real-time "
                 "context.*test-faulty: function 'f.run' made the call that the real-time guard "
                 "prints above");
#else
    EXPECT_DEATH(machine.cycles(1), "real-time guard: [a-z_]+ in a cycle");
#endif
}
INSTANTIATE_TEST_SUITE_P(Component, Guard, testing::Values("allocates", "frees", "locks", "sleeps"),
                         [](const auto& fault) { return fault.param; });

TEST_F(Guard, lets_everything_pass_outside_of_cycles) {
    machine.must("loadrt test-counter count=100");
    machine.must("unloadrt test-counter");
    machine.cycles(10);
    EXPECT_EQ(machine.get("t.threadbeat"), "20");
}

}  // namespace
}  // namespace hal::test
