// SPDX-License-Identifier: MIT
// Every component of the build tree runs a thousand cycles under the real-time guard, its inputs
// changing at random.
#include <sys/resource.h>

#include <limits>

#include "rt/any_component.hpp"
#include "rt/guard.hpp"
#include "unit/machine.hpp"

namespace hal::test {
namespace {

long page_faults() {
    rusage usage{};
    getrusage(RUSAGE_THREAD, &usage);
    return usage.ru_minflt + usage.ru_majflt;
}

struct Component : testing::TestWithParam<std::string> {
    // One instance, all functions in one thread; `linked`: every pin on a signal of its own.
    void run(bool linked) {
        Machine machine;
        const auto lock = machine.session.lock();
        machine.must("newthread t 1000000\n" + load(GetParam()));
        std::string text;
        for (const LoadedFunction* function : machine.session.model().sorted_functions()) {
            text += "addf " + function->name + " t\n";
        }
        int number = 0;
        for (const Pin* pin : machine.session.model().sorted_pins()) {
            if (!linked || !pin->instance || pin->dir == HAL_DIR_PARAM) continue;
            text += "net s" + std::to_string(++number) + " " + pin->name + "\n";
            if (pin->type == HAL_TYPE_PORT) {
                text += "sets s" + std::to_string(number) + " 256\n";
            }
        }
        machine.must(text);
        RandomInputs inputs(machine.session.model(), 1);
        machine.start();
        long fewest = std::numeric_limits<long>::max();
        for (int part = 0; part < 10; ++part) {
            const long before = page_faults();
            for (int cycle = 0; cycle < 100; ++cycle) {
                inputs.change();
                machine.cycles(1);
            }
            if (part > 0) {
                fewest = std::min(fewest, page_faults() - before);
            }
        }
        EXPECT_EQ(machine.get("t.threadbeat"), "1000");
        for (const FaultRecord& fault : machine.session.reports().faults()) {
            EXPECT_NE(fault.code, "exception") << fault.sentence;
        }
        // the kernel may take a page away at any moment, but not in each of nine rows of a hundred
        // cycles
        if (guarded) {
            EXPECT_EQ(fewest, 0) << "it touches new memory all the time";
        }
    }
};

TEST_P(Component, neither_allocates_nor_locks_nor_blocks) { run(false); }
TEST_P(Component, neither_allocates_nor_locks_nor_blocks_with_all_pins_linked) { run(true); }

INSTANTIATE_TEST_SUITE_P(Of, Component, testing::ValuesIn(all_components()),
                         [](const auto& component) { return component.param; });

TEST(All_components, are_found) { EXPECT_GT(all_components().size(), 30u); }

// All of them at once on a real thread, with edits: taking plans, carrying values and answering are
// real time, too.
TEST(All_components, run_together_on_a_real_thread_while_it_is_edited) {
    Machine machine(Clock::real);
    const auto lock = machine.session.lock();
    std::string text = "newthread t 2000000\nnewthread u 4000000\n";
    for (const std::string& name : all_components()) {
        if (name == "hm2_eth") continue;  // mesa under another name, with the same instances
        text += load(name);
    }
    machine.must(text + "loadrt test-counter names=a,b\nloadrt test-two names=w\n");
    machine.must(
        "addf a t\naddf w.fast t\naddf w.first u\naddf w.last u\nnet a w.a => w.a-in "
        "w.a-again\nnet b w.b => w.b-in w.b-again");
    machine.must("addf --auto t");
    machine.start();
    for (int i = 0; i < 50; ++i) {
        machine.must(i % 2 ? "delf a t\naddf a t\ndelsig x"
                           : "delf b t\naddf b t 1\nnet x a.sum => b.step\nsetp a.step 2");
    }
    ASSERT_TRUE(eventually([&] { return machine.number("t.threadbeat") >= 300; }));
    EXPECT_EQ(machine.get("w.torn"), "0");
}

}  // namespace
}  // namespace hal::test
