// SPDX-License-Identifier: MIT
// What goes wrong inside components: faults in the cycle, invalid plugins, threads that hang.
#include <filesystem>
#include <fstream>

#include "machine.hpp"
#include "plugins/watch.hpp"

namespace hal::test {
namespace {

namespace fs = std::filesystem;

struct Faulty : testing::Test {
    Faulty() {
        machine.must(
            "loadrt threads name1=t period1=1000000 name2=u period2=2000000\nloadrt test-faulty "
            "names=f\nloadrt test-counter names=c,d\naddf f.run t\naddf c t\naddf d u\nnet v "
            "f.value\nnet on f.on\nnet c-on c.on");
    }
    Machine machine;
};

TEST_F(Faulty, A_function_that_throws_stops_its_thread_only) {
    machine.start();
    machine.cycles(4);
    machine.must("setp f.throws 1");
    machine.cycles(4);
    EXPECT_EQ(machine.get("c.count"), "4");
    EXPECT_EQ(machine.get("d.count"), "4");
    EXPECT_EQ(machine.get("on"), "FALSE");
    EXPECT_EQ(machine.get("v"), "-5");
    EXPECT_EQ(machine.get("c-on"), "FALSE");
    EXPECT_TRUE(machine.session.reports().threads()[0].faulted);
    EXPECT_FALSE(machine.session.reports().threads()[1].faulted);
    const auto faults = machine.session.reports().faults();
    ASSERT_EQ(faults.size(), 1u);
    EXPECT_EQ(faults[0].code, "exception");
    EXPECT_EQ(faults[0].thread, "t");
    EXPECT_EQ(faults[0].cycle, 4u);
    EXPECT_EQ(
        faults[0].sentence,
        "t: function 'f.run' (test-faulty) threw an exception at cycle 4; the thread's functions "
        "are stopped and its outputs were set to their safe values; see: show thread, start");
    machine.must("setp f.throws 0");
    machine.cycles(2);
    EXPECT_EQ(machine.get("c.count"), "4") << "it stays stopped until start";
    machine.start();
    machine.cycles(2);
    EXPECT_EQ(machine.get("c.count"), "6");
    EXPECT_EQ(machine.get("on"), "TRUE");
    EXPECT_FALSE(machine.session.reports().threads()[0].faulted);
}

TEST_F(Faulty, A_function_that_throws_again_and_again_is_caught_again_and_again) {
    machine.must("setp f.throws 1");
    for (int i = 1; i <= 100; ++i) {
        machine.start();
        machine.cycles(2);
        ASSERT_EQ(machine.session.reports().fault_count(), static_cast<std::uint64_t>(i));
    }
    machine.session.reports().clear_faults();
    EXPECT_EQ(machine.session.reports().fault_count(), 1u) << "its functions are stopped";
    machine.must("setp f.throws 0");
    machine.start();
    machine.session.reports().clear_faults();
    EXPECT_EQ(machine.session.reports().fault_count(), 0u);
    EXPECT_TRUE(machine.session.reports().faults().empty());
}

TEST_F(Faulty, Not_a_number_on_a_finite_output_is_replaced_and_one_fault_per_row) {
    machine.start();
    machine.cycles(2);
    machine.must("setp f.bad-number 1");
    machine.cycles(5);
    EXPECT_EQ(machine.get("v"), "-5");
    EXPECT_EQ(machine.session.reports().fault_count(), 1u);
    EXPECT_EQ(machine.get("c.count"), "7") << "the thread goes on";
    machine.must("setp f.bad-number 0");
    machine.cycles(1);
    EXPECT_EQ(machine.get("v"), "7");
    machine.must("setp f.bad-number 1");
    machine.cycles(3);
    EXPECT_EQ(machine.session.reports().fault_count(), 2u);
    EXPECT_EQ(
        machine.session.reports().faults()[0].sentence,
        "t: pin 'f.value' (test-faulty) became nan at cycle 2; it was set to -5; see: show pin f");
}

TEST_F(Faulty, A_component_raises_faults_of_its_own) {
    machine.must("setp f.raises 1");
    machine.start();
    machine.cycles(1);
    machine.must("setp f.raises 0\nunloadrt f");  // the words are the plugin's, and it is gone
    const auto faults = machine.session.reports().faults();
    ASSERT_EQ(faults.size(), 1u);
    EXPECT_EQ(faults[0].code, "component");
    EXPECT_NE(faults[0].sentence.find("a finger in the gear (3) at cycle 0"), std::string::npos)
        << faults[0].sentence;
}

TEST(FaultsOnTheRealClock, Have_an_age_that_grows) {
    Machine machine(Clock::real);
    machine.must(
        "loadrt threads name1=t period1=1000000\nloadrt test-faulty names=f\naddf f.run t\nsetp "
        "f.raises 1");
    machine.start();
    ASSERT_TRUE(eventually([&] { return !machine.session.reports().faults().empty(); }));
    const auto age = machine.session.reports().faults()[0].age_ns;
    EXPECT_GT(age, 0);
    EXPECT_TRUE(eventually([&] { return machine.session.reports().faults()[0].age_ns > age; }));
}

TEST_F(Faulty, The_faults_of_a_deleted_thread_are_still_reported) {
    machine.must("setp f.throws 1");
    machine.start();
    machine.cycles(1);
    machine.must("delthread t");
    ASSERT_EQ(machine.session.reports().faults().size(), 1u);
    EXPECT_EQ(machine.session.reports().faults()[0].thread, "t");
}

TEST_F(Faulty, More_faults_than_are_kept_are_counted) {
    machine.must("setp f.raises 1");
    machine.start();
    machine.cycles(5000);
    EXPECT_EQ(machine.session.reports().fault_count(), 5000u);
    EXPECT_LE(machine.session.reports().faults().size(), 1000u);
}

TEST_F(Faulty, A_storm_of_one_kind_is_one_record_with_a_count_and_buries_no_other) {
    machine.must("setp f.bad-number 1");
    machine.start();
    machine.cycles(1);
    machine.must("setp f.raises 1");
    machine.cycles(5000);
    machine.must("setp f.raises 0");
    machine.cycles(1500);
    const auto faults = machine.session.reports().faults();
    ASSERT_EQ(faults.size(), 6u) << "the first four of a storm stand for themselves";
    EXPECT_EQ(faults[0].code, "not-finite");
    EXPECT_EQ(faults[0].count, 1u);
    EXPECT_EQ(faults[0].line(), faults[0].sentence);
    EXPECT_EQ(faults[5].count, 4996u);
    EXPECT_EQ(faults[5].line(), faults[5].sentence + " (4996 times in 5.0 s)");
    machine.must("setp f.raises 1");
    machine.cycles(1);
    EXPECT_EQ(machine.session.reports().faults().size(), 7u)
        << "after a quiet second it is another one";
}

TEST(A_cycle_beyond_its_budget, is_a_fault_once_per_row) {
    Machine machine(Clock::real);
    machine.must("newthread t 20000000 budget=1ms\nloadrt test-faulty names=f\naddf f.run t");
    machine.start();
    machine.must("setp f.slow 3000");
    ASSERT_TRUE(
        eventually([&] { return machine.session.reports().threads()[0].over_budget >= 3; }));
    const auto faults = machine.session.reports().faults();
    ASSERT_FALSE(faults.empty());
    EXPECT_EQ(faults[0].code, "budget");
    EXPECT_NE(faults[0].sentence.find("(budget 1 ms)"), std::string::npos) << faults[0].sentence;
}

TEST(A_cycle_that_ends_after_the_next_deadline, is_counted_as_an_overrun) {
    Machine machine(Clock::real);
    machine.must("newthread t 20000000\nloadrt test-faulty names=f\naddf f.run t");
    machine.start();
    machine.must("setp f.slow 25000");
    const Reports& reports = machine.session.reports();
    ASSERT_TRUE(eventually([&] { return reports.threads()[0].overruns >= 3; }));
    EXPECT_LT(reports.threads()[0].over_budget, reports.threads()[0].overruns)
        << "the thread has no budget";
}

TEST(Missed_periods, are_counted_and_skipped_and_the_phase_stays) {
    Machine machine(Clock::real);
    machine.must("newthread t 10000000\nloadrt test-faulty names=f\naddf f.run t");
    machine.start();
    machine.must("setp f.slow 45000");
    ASSERT_TRUE(eventually([&] { return machine.session.reports().threads()[0].missed >= 8; }));
    machine.must("setp f.slow 0");
    const auto seen = machine.get_all({"t.missed", "t.threadbeat"});
    EXPECT_GE(std::stoll(seen[0]), 6)
        << "the pin is written when the overrun has ended, the report counts up to now";
    EXPECT_EQ(machine.session.reports().fault_count(), 0u)
        << "an overrun raises no fault without a budget";
}

// --- a thread that hangs -----------------------------------------------------------------------------------------------

TEST(A_function_that_hangs, rejects_edits_with_its_name_and_leaves_the_other_threads_running) {
    Watch watch;
    Machine machine(Clock::real);
    machine.must("newthread good 1000000\nnewthread bad 2000000\nloadrt test-life names=x " +
                 watch.argument() +
                 "\nloadrt test-counter names=c,d\naddf x bad\naddf c good\nnet s c.sum");
    machine.start();
    ASSERT_TRUE(eventually([&] { return watch.runs > 2; }));
    watch.hang = true;
    ASSERT_TRUE(eventually([&] { return watch.hanging.load(); }));

    EXPECT_FALSE(
        machine.edit("loadrt test-counter names=e\naddf e good\nsetp c.step 5\nnet s e.step"));
    EXPECT_NE(machine.said.find("thread 'bad' has not finished a cycle for "), std::string::npos)
        << machine.said;
    EXPECT_NE(machine.said.find("function 'x' (test-life) does not return [hung-thread]"),
              std::string::npos)
        << machine.said;
    EXPECT_EQ(machine.session.model().find_instance("e"), nullptr);
    EXPECT_EQ(machine.get("c.step"), "1");
    const auto counted = machine.number("c.count");
    EXPECT_TRUE(eventually([&] { return machine.number("c.count") > counted + 5; }))
        << "the good thread runs on";
    EXPECT_FALSE(machine.edit("delthread bad"));
    EXPECT_NE(machine.said.find("[hung-thread]"), std::string::npos);
    EXPECT_FALSE(machine.edit("setp x.in 1"));
    EXPECT_NE(machine.said.find("[hung-thread]"), std::string::npos);
    EXPECT_FALSE(machine.session.threads().start());
    const ThreadReport report = machine.session.reports().threads()[1];
    EXPECT_TRUE(report.hung && report.faulted);
    EXPECT_EQ(report.function, "x");
    machine.must("setp c.step 2");  // values reach the threads that answer
    EXPECT_NE(machine.get_all({"x.level", "x.out"})[0], "?") << "it can still be looked at";

    watch.hang = false;
    ASSERT_TRUE(eventually([&] { return !machine.session.reports().threads()[1].hung; }));
    EXPECT_EQ(machine.get("x.out"), "TRUE")
        << "its safe value, not that of the cycle that ended late";
    EXPECT_TRUE(machine.session.threads().start());
    const auto runs = watch.runs.load();
    ASSERT_TRUE(eventually([&] { return watch.runs > runs + 2; }));
    machine.must("loadrt test-counter names=e\naddf e good\nnet s e.step");
    machine.must("delthread bad");
    EXPECT_EQ(watch.max_inside, 1);
}

TEST(A_function_that_hangs, leaves_safe_values_to_other_threads_and_is_one_fault) {
    static Watch watch;
    Machine machine(Clock::real);
    machine.must("newthread bad 1000000\nnewthread good 2000000\nloadrt test-life names=x,y " +
                 watch.argument() +
                 "\nloadrt test-counter names=c,d\naddf c bad\naddf x bad\naddf d good\nnet level "
                 "x.level => d.step\nnet on c.on");
    machine.start();
    ASSERT_TRUE(eventually([&] { return watch.runs > 2; }));
    const int emergencies = watch.emergencies;
    watch.hang = true;
    ASSERT_TRUE(eventually([&] { return machine.session.reports().fault_count() != 0; }));
    EXPECT_EQ(machine.get("x.level"), "-1");
    EXPECT_TRUE(eventually([&] { return machine.get("d.step") == "-1"; }))
        << "the other thread reads the safe value";
    EXPECT_GT(watch.emergencies, emergencies);
    const auto missed = machine.session.reports().threads()[0].missed;
    EXPECT_TRUE(eventually([&] {
        return machine.session.reports().threads()[0].missed > missed + 100;
    })) << "by the clock";
    EXPECT_EQ(machine.session.reports().fault_count(), 1u);
    const auto faults = machine.session.reports().faults();
    ASSERT_EQ(faults.size(), 1u);
    EXPECT_EQ(faults[0].code, "hung-thread");
    EXPECT_NE(faults[0].sentence.find("bad: function 'x' (test-life) has not returned"),
              std::string::npos)
        << faults[0].sentence;
    watch.hang = false;
    ASSERT_TRUE(eventually([&] { return !machine.session.reports().threads()[0].hung; }));
    EXPECT_EQ(machine.get("x.level"), "-1");
    EXPECT_EQ(machine.session.reports().fault_count(), 1u)
        << "the return of the function raises no second fault";
    machine.start();
    EXPECT_TRUE(eventually([&] { return machine.get("x.level") == "7"; }));
    EXPECT_EQ(machine.session.reports().threads()[0].hangs, 1u);
}

TEST(A_thread_without_supervision, may_hang_and_goes_on) {
    Watch watch;
    Machine machine(Clock::real);
    machine.must("newthread t 1000000 supervise=off\nloadrt test-life names=x " + watch.argument() +
                 "\naddf x t");
    machine.start();
    ASSERT_TRUE(eventually([&] { return watch.runs > 2; }));
    watch.hang = true;
    ASSERT_TRUE(eventually([&] { return machine.session.reports().threads()[0].missed > 300; }));
    EXPECT_EQ(machine.session.reports().threads()[0].hangs, 0u);
    watch.hang = false;
    const auto runs = watch.runs.load();
    EXPECT_TRUE(eventually([&] { return watch.runs > runs + 2; }));
}

TEST(A_cycle_of_many_periods, is_a_fault_that_names_the_function) {
    Machine machine(Clock::real);
    machine.must(
        "newthread t 1000000\nloadrt test-faulty names=f\nloadrt test-counter names=c\naddf c "
        "t\naddf f.run t");
    machine.start();
    machine.must("setp f.slow 30000");
    // The supervisor samples: on a busy host the first fault may name another function.
    std::string sentence;
    EXPECT_TRUE(eventually([&] {
        for (const auto& fault : machine.session.reports().faults()) {
            if (sentence = fault.sentence;
                fault.code == "overrun" &&
                sentence.find("periods), last seen in function 'f.run' (test-faulty)") !=
                    sentence.npos) {
                return true;
            }
        }
        machine.session.reports().clear_faults();
        return false;
    })) << sentence;
    machine.must("setp f.slow 0");
    EXPECT_FALSE(machine.session.reports().threads()[0].faulted) << "it goes on";
}

TEST(A_session, ends_while_a_function_hangs) {
    static Watch watch;  // the thread may go on using it
    {
        Machine machine(Clock::real);
        machine.must("newthread bad 2000000\nloadrt test-life names=x " + watch.argument() +
                     "\naddf x bad");
        machine.start();
        watch.hang = true;
        ASSERT_TRUE(eventually([&] { return watch.hanging.load(); }));
    }
    EXPECT_EQ(watch.destroyed, 0) << "nobody takes away what it uses";
    watch.hang = false;
    const auto runs = watch.runs.load();
    ASSERT_TRUE(eventually([&] { return watch.runs > runs || !watch.hanging; }));
}

// --- invalid plugins ---------------------------------------------------------------------------------------------------

struct Bad {
    const char *component, *code, *words;
};
struct BadPlugin : testing::TestWithParam<Bad> {};
TEST_P(BadPlugin, is_a_diagnostic) {
    Machine machine;
    machine.rejected(std::string("loadrt ") + GetParam().component, GetParam().code);
    EXPECT_NE(machine.said.find(GetParam().words), std::string::npos) << machine.said;
}
INSTANTIATE_TEST_SUITE_P(
    Built, BadPlugin,
    testing::Values(Bad{"test-pin-twice", "construct-failed",
                        "declares pin 'test-pin-twice.0.in' twice"},
                    Bad{"test-function-below", "construct-failed",
                        "pin 'in' uses a function that is declared below it"},
                    Bad{"test-other-version", "bad-plugin",
                        "version 2 of the component interface, this runtime has 1"},
                    Bad{"test-short", "bad-plugin", "at least"},
                    Bad{"test-no-symbol", "bad-plugin", "it exports no symbol hal_plugin"},
                    Bad{"../plugins/test-counter", "no-such-component", "unknown component"}));

struct BadFile : testing::Test {
    BadFile() : folder(fs::temp_directory_path() / ("halcyon-bad-" + std::to_string(getpid()))) {
        fs::create_directories(folder);
        std::ifstream from(std::string(HALCYON_TEST_PLUGINS) + "/test_counter.so",
                           std::ios::binary);
        good.assign(std::istreambuf_iterator<char>(from), {});
    }
    ~BadFile() override { fs::remove_all(folder); }
    // returns what loading a file of these bytes reports
    std::string load(const std::string& bytes) {
        std::ofstream(folder / "broken.so", std::ios::binary) << bytes;
        SessionOptions options;
        options.check_only = true;
        options.plugin_path = {folder.string()};
        Session session(options);
        Diagnostics diagnostics;
        const auto source = session.sources.add("x", "loadrt broken\n");
        Transaction transaction = session.begin();
        for (const Command& command : parse(session.sources, source, {}, diagnostics)) {
            apply_edit(transaction, command, diagnostics);
        }
        return transaction.commit(diagnostics) ? "" : render(diagnostics, session.sources);
    }
    fs::path folder;
    std::string good;
};

TEST_F(BadFile, That_is_empty_is_a_diagnostic) {
    EXPECT_NE(load("").find("[bad-plugin]"), std::string::npos);
}
TEST_F(BadFile, That_is_text_is_a_diagnostic) {
    EXPECT_NE(load("int main() { return 0; }\n").find("it is not a shared library [bad-plugin]"),
              std::string::npos);
}
TEST_F(BadFile, That_is_complete_loads) { EXPECT_EQ(load(good), ""); }
TEST_F(BadFile, Cut_anywhere_is_a_diagnostic) {
    ASSERT_GT(good.size(), 5000u);
    for (std::size_t part = 0; part < 64; ++part) {
        const std::size_t bytes = good.size() * part / 64;
        ASSERT_NE(load(good.substr(0, bytes)).find("[bad-plugin]"), std::string::npos)
            << bytes << " of " << good.size();
    }
    ASSERT_NE(load(good.substr(0, good.size() - 1)).find("[bad-plugin]"), std::string::npos);
}
TEST_F(BadFile, For_another_machine_is_a_diagnostic) {
    std::string other = good;
    other[18] = 8;  // e_machine: MIPS
    EXPECT_NE(load(other).find("[bad-plugin]"), std::string::npos);
    other = good;
    other[4] = sizeof(void*) == 8 ? 1 : 2;  // 32 or 64 bits, as this machine is not
    EXPECT_NE(load(other).find("[bad-plugin]"), std::string::npos);
}

}  // namespace
}  // namespace hal::test
