// SPDX-License-Identifier: MIT
// Transactions are atomic: an edit is rolled back exactly when another one of the same transaction
// fails.
#include "machine.hpp"
#include "plugins/watch.hpp"

namespace hal::test {
namespace {

// A machine with something of everything, running.
struct Transaction : testing::TestWithParam<const char*> {
    Transaction() {
        machine.must(
            "loadrt threads name1=t period1=1000000 name2=u period2=2000000\nloadrt test-types "
            "names=x,y,z\nloadrt test-counter names=a,b\nloadrt test-shared count=2\n"
            "loadrt test-port names=p,q\nloadrt test-two names=w\n"
            "addf x t\naddf y t\naddf a t\naddf b u\naddf test-shared.update t\ninitf p u\naddf "
            "w.fast t\naddf w.first u\naddf w.last u\n"
            "net one x.s32-out => y.s32-in\nnet two x.s64-in z.s64-in\nnet three x.bit-io y.bit-io "
            "z.bit-io\nnet stream p.to => q.from\nsets stream 32\nnet fresh a.sum => b.step\n"
            "net w-a w.a => w.a-in w.a-again\nnewsig lonely float\nsets lonely 2.5\nalias pin "
            "x.u32-in speed\nsetp x.u32-in 3\nsetp z.u64-in 18446744073709551615\nsets two "
            "-9223372036854775807\n");
        machine.start();
        machine.cycles(10);
    }
    Machine machine;
};

TEST_P(Transaction, is_rolled_back_exactly_when_its_last_command_fails) {
    machine.rejected(std::string(GetParam()) + "\nsetp nowhere 1", "no-such-pin");
    machine.cycles(2);  // and the machine runs on
    EXPECT_EQ(machine.get("a.count"), "12");
    machine.must(GetParam());  // nothing was left that would be in the way
}

TEST_P(Transaction, is_rolled_back_exactly_when_an_instance_cannot_start) {
    machine.rejected(std::string(GetParam()) + "\nloadrt test-life names=bad fail=start",
                     "start-failed");
    machine.must(GetParam());
}

TEST_P(Transaction, is_rolled_back_exactly_when_a_rule_over_the_whole_model_fails) {
    machine.rejected(
        std::string(GetParam()) +
            "\nloadrt threads name1=m period1=8000000 name2=n period2=16000000\nloadrt test-two "
            "names=tied common=1\naddf tied.fast m\naddf tied.first n",
        "spread-pins");
    machine.must(GetParam());
}

INSTANTIATE_TEST_SUITE_P(
    Of, Transaction,
    testing::Values(
        "newsig n bit", "net n x.bit-in y.bit-out", "net one z.s32-in", "setp x.float-in 7",
        "setp z.float-in 7", "sets lonely 9", "sets two 5", "setp x.float-param 1", "delsig one",
        "delsig all", "delsig two\nnewsig two bit", "delsig stream", "newsig s2 port\nsets s2 100",
        "unlinkp x.s32-out\nsets one 4", "unlinkp x.bit-io", "unlinkp p.to", "delf x t",
        "delf x t\naddf x t 1", "delf x t\naddf x u", "delf test-shared.update t",
        "delf w.fast t\naddf w.fast u", "addf z t 1", "addf z u", "newthread v 4000000\ninitf q v",
        "newthread v 4000000 \naddf z v", "loadrt threads name1=v period1=4000000", "delthread u",
        "delthread t", "delthread t\ndelthread u", "unloadrt threads", "loadrt test-counter",
        "loadrt test-counter count=3", "loadrt test-counter names=g,h\naddf g t\nnet fresh g.step",
        "loadrt test-single", "loadrt test-shared count=2 kind=1,2", "unloadrt a",
        "unloadrt test-counter", "unloadrt test-shared", "unloadrt test-shared.0",
        "unloadrt x\nunloadrt y", "unloadrt all", "unloadrt p\nloadrt test-port names=p",
        "loadrt test-counter names=n\naddf n t\nunloadrt n", "alias pin y.u32-in other",
        "unalias pin speed", "unalias pin speed\nalias pin y.u32-in speed",
        "unloadrt x\nalias pin y.u32-in speed",
        "net fresh x.float-in y.float-in\nunlinkp y.float-in", "linkpp x.u64-out y.u64-in",
        "delsig fresh\nnet fresh2 a.sum => x.float-in", "addf --auto u", "addf --auto t z",
        "setp a.tmax 4\nsetp t.tmax 5", "net ticks t.threadbeat",
        "net ticks t.threadbeat\ndelthread t", "net time a.time\nunloadrt a"),
    [](const auto& edit) { return std::to_string(edit.index); });

TEST(A_transaction, reports_all_its_errors_at_once) {
    Machine machine;
    EXPECT_FALSE(machine.edit("setp nothing 1\naddf f t\nloadrt nowhere\nnewsig a colour\n"));
    for (const char* code :
         {"[no-such-pin]", "[no-such-component]", "[no-such-type]", "[no-such-function]"}) {
        EXPECT_NE(machine.said.find(code), std::string::npos) << code << machine.said;
    }
}

TEST(A_transaction, is_open_until_commit_or_destruction) {
    Machine machine;
    Diagnostics diagnostics;
    const std::string before = machine.dump();
    EXPECT_FALSE(machine.session.in_transaction());
    {
        hal::Transaction transaction = machine.session.begin();
        machine.apply(transaction, "loadrt threads\nloadrt test-counter\nnewsig a bit",
                      diagnostics);
        EXPECT_TRUE(machine.session.in_transaction());
        const hal::Transaction moved = std::move(transaction);
        EXPECT_NE(before, machine.dump());
    }
    EXPECT_FALSE(machine.session.in_transaction());
    EXPECT_EQ(before, machine.dump());
}

TEST(A_transaction, is_the_only_one_and_ends_once) {
    Machine machine;
    Diagnostics diagnostics;
    hal::Transaction transaction = machine.session.begin();
    EXPECT_THROW(machine.session.begin(), std::logic_error);
    EXPECT_TRUE(transaction.commit(diagnostics)) << "nothing was edited: nothing to do";
    EXPECT_THROW(transaction.commit(diagnostics), std::logic_error);
    transaction.roll_back();
    EXPECT_FALSE(machine.session.in_transaction());
    machine.session.begin().roll_back();
    EXPECT_TRUE(machine.session.begin().commit(diagnostics));
}

TEST(A_transaction, runs_its_actions_only_after_the_commit) {
    Machine machine;
    int done = 0;
    const auto act = [&](const std::string& text, bool commit) {
        Diagnostics diagnostics;
        hal::Transaction transaction = machine.session.begin();
        transaction.when_committed([&] {
            EXPECT_FALSE(machine.session.in_transaction());
            ++done;
        });
        machine.apply(transaction, text, diagnostics);
        if (commit) {
            transaction.commit(diagnostics);
        }
    };
    act("newsig a bit", true);
    EXPECT_EQ(done, 1);
    act("newsig b bit", false);
    act("newsig a bit", true);
    EXPECT_EQ(done, 1);
}

TEST(An_open_transaction, shows_the_values_that_its_edits_give) {
    Machine machine;
    machine.must(
        "loadrt threads name1=t period1=1000000\nloadrt test-types names=x,y\naddf x t\naddf y "
        "t\nsetp x.float-in 1\nnewsig s float\nsets s 3\nnewsig free float\nsets free 4\n");
    machine.start();
    machine.cycles(3);
    const std::string before = machine.dump();
    {
        Diagnostics diagnostics;
        hal::Transaction transaction = machine.session.begin();
        machine.apply(transaction,
                      "setp x.float-in 7\nsets free 5\nloadrt test-types names=z\nsetp z.float-in "
                      "9\nnet n z.float-in y.float-in\nnet s x.float-in",
                      diagnostics);
        EXPECT_FALSE(diagnostics.failed()) << render(diagnostics, machine.session.sources);
        EXPECT_EQ(machine.get("free"), "5");
        EXPECT_EQ(machine.get("z.float-in"), "9");
        EXPECT_EQ(machine.get("y.float-in"), "9");
        EXPECT_EQ(machine.get("n"), "9");
        const std::string seen = machine.get("x.float-in");
        EXPECT_TRUE(transaction.commit(diagnostics))
            << render(diagnostics, machine.session.sources);
        EXPECT_EQ(machine.get("x.float-in"), seen);
        EXPECT_EQ(machine.get("y.float-in"), "9");
    }
    EXPECT_NE(before, machine.dump());
}

TEST(Values_of_one_transaction, reach_a_thread_in_one_cycle_even_when_they_are_many) {
    Machine machine;
    std::string text =
                    "loadrt threads name1=t period1=1000000\nloadrt test-counter count=3000\naddf "
                    "test-counter.2999 t\n",
                sets;
    machine.must(text);
    for (int i = 0; i < 3000; ++i) {
        sets += "setp test-counter." + std::to_string(i) + ".step 5\n";
    }
    machine.must("addf --auto t");
    machine.start();
    machine.cycles(1);
    machine.must(sets);
    machine.cycles(1);
    for (const char* name :
         {"test-counter.0.sum", "test-counter.1500.sum", "test-counter.2999.sum"}) {
        EXPECT_EQ(machine.get(name), "6");
    }
}

TEST(An_instance_that_cannot_start, rolls_back_the_load_and_stops_those_started_before) {
    Watch watch;
    Machine machine;
    machine.must("loadrt threads");
    machine.rejected("loadrt test-life names=x,y " + watch.argument() +
                         "\nloadrt test-life names=z fail=start\naddf x thread1",
                     "start-failed");
    EXPECT_NE(machine.said.find("the test rejects the start"), std::string::npos);
    EXPECT_EQ(watch.started, 2);
    EXPECT_EQ(watch.stopped, 2);
    EXPECT_EQ(watch.destroyed, 2);
    EXPECT_EQ(watch.emergencies, 2) << "outputs of hardware that was touched are made safe";
}

TEST(A_constructor_that_throws, rolls_back_the_load) {
    Watch watch;
    Machine machine;
    machine.rejected("loadrt test-life names=x " + watch.argument() +
                         "\nloadrt test-life names=z fail=construct",
                     "construct-failed");
    EXPECT_NE(machine.said.find("the test rejects the construction"), std::string::npos);
    EXPECT_EQ(watch.constructed, 1);
    EXPECT_EQ(watch.started, 0);
    EXPECT_EQ(watch.destroyed, 1);
}

}  // namespace
}  // namespace hal::test
