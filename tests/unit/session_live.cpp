// SPDX-License-Identifier: MIT
// Edits of a running machine, on real threads. Everything waits for cycles or events, never for
// time.
#include <atomic>
#include <random>
#include <set>

#include "machine.hpp"
#include "plugins/watch.hpp"

namespace hal::test {
namespace {

#if defined(__SANITIZE_THREAD__) || defined(__SANITIZE_ADDRESS__)
constexpr int edits = 1500;  // the sanitizers make each ten times as long
#else
constexpr int edits = 10'000;
#endif

struct Live : testing::Test {
    Live() : machine(Clock::real) {
        machine.must(
            "loadrt threads name1=fast period1=1000000 name2=slow period2=2000000\nloadrt "
            "test-counter names=a,b,c\n");
    }
    void until(const std::string& pin, std::int64_t at_least) {
        ASSERT_TRUE(eventually([&] { return machine.number(pin) >= at_least; }))
            << pin << " stands at " << machine.get(pin);
    }
    Machine machine;
};

TEST_F(Live, A_counter_loses_and_doubles_no_step_over_edits_around_it) {
    machine.must("addf a fast\naddf b fast\nnet s a.count");
    machine.start();
    for (int i = 0; i < 50; ++i) {
        machine.must(i % 2 ? "delsig x\ndelf c fast"
                           : "net x a.sum => b.step c.step\naddf c fast 1");
        const auto seen = machine.get_all({"a.count", "a.sum", "a.twin", "s"});
        EXPECT_EQ(seen[0], seen[1]);
        EXPECT_EQ(seen[0], seen[2]);
        EXPECT_EQ(seen[0], seen[3]);
    }
    const auto first = machine.get_all({"a.count", "fast.threadbeat"});
    until("a.count", std::stoll(first[0]) + 20);
    const auto last = machine.get_all({"a.count", "fast.threadbeat"});
    EXPECT_EQ(std::stoll(last[0]) - std::stoll(first[0]),
              std::stoll(last[1]) - std::stoll(first[1]))
        << "a run per cycle";
}

TEST_F(Live, Edits_of_every_kind_take_effect_while_running) {
    machine.must("addf a fast");
    machine.start();
    until("a.count", 3);
    machine.must("setp a.step 10");
    const double before = std::stod(machine.get("a.sum"));
    until("a.count", machine.number("a.count") + 3);
    EXPECT_GE(std::stod(machine.get("a.sum")), before + 30 - 1);
    machine.must("net x a.sum => b.step\naddf b fast");
    until("b.count", 3);
    machine.must(
        "newthread slower 4000000\nloadrt test-counter names=d\naddf d slower\nnet x d.step");
    until("d.count", 3);
    EXPECT_GT(std::stod(machine.get("d.sum")), 0.0);
    machine.must("unlinkp a.sum\nsets x 0.5");
    until("b.count", machine.number("b.count") + 2);
    EXPECT_EQ(machine.get("b.step"), "0.5");
    EXPECT_EQ(machine.get("d.step"), "0.5");
    machine.must("delthread slower");
    const auto stands = machine.get("d.count");
    machine.must("unloadrt b");
    EXPECT_EQ(machine.get("b.count"), "?");
    until("a.count", machine.number("a.count") + 3);
    EXPECT_EQ(machine.get("d.count"), stands);
    machine.stop();
    const auto stopped = machine.get("a.count");
    until("fast.threadbeat", machine.number("fast.threadbeat") + 3);
    EXPECT_EQ(machine.get("a.count"), stopped);
    EXPECT_EQ(machine.get("a.on"), "FALSE");
}

TEST_F(Live, A_function_moved_between_running_threads_is_never_in_both) {
    Watch watch;
    machine.must("loadrt test-life names=x " + watch.argument() + "\naddf x fast");
    machine.start();
    for (int i = 0; i < 60; ++i) {
        machine.must(i % 2 ? "delf x slow\naddf x fast" : "delf x fast\naddf x slow");
        const auto runs = watch.runs.load();
        ASSERT_TRUE(eventually([&] { return watch.runs > runs; }));
    }
    EXPECT_EQ(watch.max_inside, 1);
    machine.must("unloadrt x");
}

TEST_F(Live, What_one_thread_reads_from_another_is_of_one_cycle) {
    machine.must(
        "loadrt test-two names=w\naddf w.fast fast\naddf w.first slow\naddf w.last slow\nnet a w.a "
        "=> w.a-in w.a-again\nnet b w.b => w.b-in w.b-again");
    machine.start();
    until("w.looks", 200);
    EXPECT_EQ(machine.get("w.torn"), "0");
    for (int i = 0; i < 30; ++i) {
        machine.must(i % 2 ? "delf c fast" : "addf c fast 1");
    }
    until("w.looks", 300);
    EXPECT_EQ(machine.get("w.torn"), "0");
}

TEST_F(Live, An_observer_sees_pins_of_one_cycle) {
    machine.must("addf a fast\naddf b slow");
    machine.start();
    until("a.count", 1);
    for (int i = 0; i < 200; ++i) {
        const auto seen = machine.get_all({"a.count", "b.count", "a.twin", "b.twin"});
        ASSERT_EQ(seen[0], seen[2]);
        ASSERT_EQ(seen[1], seen[3]);
    }
}

TEST_F(Live, Getp_sees_what_setp_wrote_whatever_the_thread_is_doing) {
    machine.must("addf a fast\naddf b slow");
    machine.start();
    for (int i = 0; i < 300; ++i) {
        machine.must("setp a.step " + std::to_string(i) + "\nsetp b.step " + std::to_string(-i));
        const auto seen = machine.get_all({"a.step", "a.sum", "b.step", "b.sum"});
        ASSERT_EQ(seen[0], std::to_string(i));
        ASSERT_EQ(seen[2], std::to_string(-i));
        ASSERT_EQ(machine.get("a.step"), std::to_string(i));
    }
}

TEST(A_slow_thread, takes_edits_and_answers_between_its_cycles) {
    Machine machine(Clock::real);
    machine.must(
        "newthread rare 1000000000000 policy=other\nloadrt test-counter names=a,b\naddf a rare");
    machine.start();
    // its next cycle is a quarter of an hour away; this test ends long before
    for (int i = 0; i < 20; ++i) {
        machine.must("setp a.step " + std::to_string(i));
        EXPECT_EQ(machine.get_all({"a.step", "a.count"})[0], std::to_string(i));
        machine.must(i % 2 ? "delf b rare\ndelsig s" : "addf b rare\nnet s a.sum => b.step");
    }
    machine.stop();
    machine.must("delthread rare");
}

TEST(A_period_of_more_than_a_thousand_seconds, is_rejected) {
    Machine machine;
    machine.rejected("newthread t 1000000000001", "bad-period");
}

TEST_F(Live, Priorities_fall_with_the_period_also_when_a_faster_thread_comes_later) {
    machine.must("newthread faster 500000");
    std::vector<std::string> policies;
    for (const ThreadReport& report : machine.session.reports().threads()) {
        policies.push_back(report.policy);
    }
    ASSERT_EQ(policies.size(), 3u);
    if (policies[0].starts_with("SCHED_FIFO")) {
        EXPECT_EQ(policies,
                  (std::vector<std::string>{"SCHED_FIFO 98", "SCHED_FIFO 97", "SCHED_FIFO 96"}));
    } else {
        EXPECT_FALSE(machine.session.reports().missing_privileges().empty());
    }
}

// Ten thousand edits that a seed chose: the machine counts on, the model stays whole, and nothing
// is torn.
TEST_F(Live, Random_edits_keep_a_running_machine_consistent) {
    machine.must(
        "loadrt test-two names=w\naddf w.fast fast\naddf w.first slow\naddf w.last slow\nnet wa "
        "w.a => w.a-in w.a-again\nnet wb w.b => w.b-in w.b-again\n"
        "loadrt test-types names=x,y,z\nloadrt test-port names=p,q\nloadrt test-counter "
        "names=still\naddf still fast");
    machine.start();
    std::mt19937 random(20240607);
    const auto one_of = [&](const std::vector<const char*>& words) {
        return std::string(words[random() % words.size()]);
    };
    const auto any_line = [&]() -> std::string {
        const std::string instance = one_of({"a", "b", "c", "x", "y", "z", "p", "q", "late"});

        const std::string thread = one_of({"fast", "slow"});

        const std::string signal = one_of({"s1", "s2", "s3", "s4"});
        const std::string pin =
            one_of({"a.step", "a.sum", "b.step", "b.sum", "c.step", "x.float-in", "x.float-out",
                    "y.float-io", "z.float-io", "x.s64-in", "y.s64-out", "z.bit-io", "p.to",
                    "q.from", "late.sum", "late.step"});
        switch (random() % 14) {
        case 0: return "addf " + instance + " " + thread + " " + one_of({"1", "-1", "2", ""});
        case 1: return "delf " + instance + " " + thread;
        case 2: return "delf " + instance + " fast\naddf " + instance + " slow";
        case 3: return "delf " + instance + " slow\naddf " + instance + " fast";
        case 4:
        case 5: return "net " + signal + " " + pin;
        case 6:
            return "net " + signal + " " + pin + " " +
                   one_of({"a.step", "b.step", "c.step", "x.float-in"});
        case 7: return "unlinkp " + pin;
        case 8: return "setp " + pin + " " + std::to_string(random() % 1000);
        case 9: return "sets " + signal + " " + std::to_string(1 + random() % 1000);
        case 10: return "delsig " + signal;
        case 11: return "loadrt test-counter names=late";
        case 12: return "unloadrt late";
        default: return "newsig " + signal + " " + one_of({"float", "s64", "bit", "port"});
        }
    };
    int taken = 0;
    for (int i = 0; i < edits; ++i) {
        std::string text;
        for (auto lines = 1 + random() % 2; lines > 0; --lines) {
            text += any_line() + "\n";
        }
        taken += machine.edit(text);
        if (i % 100 != 0) continue;
        const auto seen = machine.get_all({"still.count", "still.twin", "still.sum"});
        ASSERT_EQ(seen[0], seen[1]);
        ASSERT_EQ(seen[0], seen[2]);
        for (const auto& signal : machine.session.model().signals) {
            ASSERT_EQ(signal->pins.size(),
                      signal->readers + signal->ios + (signal->writer ? 1 : 0));
            for (const Pin* pin : signal->pins) {
                ASSERT_EQ(pin->signal, signal.get());
            }
        }
    }
    EXPECT_GT(taken, edits / 10) << "most random edits are rejected, but not nearly all";
    EXPECT_LT(taken, edits);
    EXPECT_EQ(machine.get("w.torn"), "0");
    until("w.looks", machine.number("w.looks") + 3);
    for (const FaultRecord& fault : machine.session.reports().faults()) {
        ADD_FAILURE() << fault.code << ": " << fault.sentence;
    }
    EXPECT_EQ(machine.session.reports().fault_count(), 0u);
}

TEST(Session, Components_read_the_status_until_their_machine_is_gone) {
    for (int machines = 0; machines < 20; ++machines) {
        Machine machine;
        {
            const auto lock = machine.session.lock();
            machine.must("newthread t 1000000\nloadrt test-status names=s\naddf s t");
            machine.start();
        }
        while (true) {
            const auto lock = machine.session.lock();
            machine.cycles(1);
            if (machine.number("s.texts") > 0) break;
        }
    }
}

}  // namespace
}  // namespace hal::test
