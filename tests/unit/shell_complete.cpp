// SPDX-License-Identifier: MIT
// Completion offers what the command would take at the cursor, and nothing else.
#include <algorithm>

#include "shell_machine.hpp"

namespace hal::test {
namespace {

struct Complete : testing::Test {
    Complete() {
        machine.must(
            "loadrt and2 names=a,b\nloadrt sum2 names=s\nloadrt encoder names=e,f\nnewthread fast "
            "100000\nnewthread slow 1000000\n"
            "addf a fast\nnet on a.out => b.in0\nnewsig level float\nnewsig flag bit\nalias pin "
            "a.in1 start\n");
    }
    /// The candidates for the end of the line, blank-separated.
    std::string after(const std::string& line) {
        std::string text;
        for (const Candidate& candidate : machine.shell.complete(line, line.size()).candidates) {
            text += (text.empty() ? "" : " ") + candidate.text;
        }
        return text;
    }
    bool offers(const std::string& line, const std::string& word) {
        const auto found = machine.shell.complete(line, line.size()).candidates;
        return std::any_of(found.begin(), found.end(),
                           [&](const Candidate& candidate) { return candidate.text == word; });
    }
    ShellMachine machine;
};

TEST_F(Complete, the_first_word_is_a_command) {
    EXPECT_EQ(after("unl"), "unlinkp unload unloadrt unloadusr unlock");
    EXPECT_EQ(after("ex"), "exit explain");
    EXPECT_EQ(after("a.i"), "");
    EXPECT_TRUE(offers("", "net"));
}

TEST_F(Complete, net_offers_signals_and_then_free_pins_of_its_type) {
    EXPECT_EQ(after("net "), "flag level on");
    // the signal has a writer: no outputs; a.out and b.in0 are taken; start is the alias of a.in1
    EXPECT_TRUE(offers("net on ", "a.in0"));
    EXPECT_TRUE(offers("net on ", "start"));
    EXPECT_FALSE(offers("net on ", "b.out"));
    EXPECT_FALSE(offers("net on ", "b.in0"));
    EXPECT_FALSE(offers("net on ", "s.in0"));
    EXPECT_FALSE(offers("net on ", "a.tmax"));
    // one without a writer takes an output
    EXPECT_TRUE(offers("net flag ", "b.out"));
    EXPECT_EQ(after("net level s.i"), "s.in0 s.in1");
    EXPECT_TRUE(offers("net level ", "s.out"));
}

TEST_F(Complete, a_new_net_takes_its_type_and_writer_from_the_pins_typed) {
    EXPECT_TRUE(offers("net new ", "s.out"));
    EXPECT_TRUE(offers("net new ", "b.out"));
    EXPECT_FALSE(offers("net new s.out => ", "b.out"));
    EXPECT_FALSE(offers("net new s.out => ", "s.out"));
    EXPECT_TRUE(offers("net new s.out => s.in0 ", "s.in1"));
    EXPECT_FALSE(offers("net new s.out => s.in0 ", "s.in0"));
    // I/O pins go together, but not with an output
    EXPECT_TRUE(offers("net new e.index-enable <=> ", "f.index-enable"));
    EXPECT_FALSE(offers("net new e.index-enable <=> ", "b.out"));
    EXPECT_FALSE(offers("net new b.out ", "f.index-enable"));
}

TEST_F(Complete, addf_offers_functions_in_no_thread_and_then_threads) {
    EXPECT_EQ(after("addf "), "--auto b encoder.capture-position encoder.update-counters s");
    EXPECT_EQ(after("addf b "), "fast slow");
    EXPECT_EQ(after("addf --auto "), "fast slow");
    EXPECT_EQ(after("addf --auto fast "), "b encoder.capture-position encoder.update-counters s");
    EXPECT_EQ(after("delf "), "a");
    EXPECT_EQ(after("delf a "), "fast");
}

TEST_F(Complete, setp_offers_what_can_be_set) {
    EXPECT_TRUE(offers("setp a.", "a.in0"));
    EXPECT_TRUE(offers("setp a.", "a.tmax"));
    EXPECT_FALSE(offers("setp a.", "a.out"));
    EXPECT_FALSE(offers("setp b.", "b.in0"));
    EXPECT_EQ(after("setp a.in0 "), "FALSE TRUE");
    EXPECT_EQ(after("setp s.in0 "), "");
    EXPECT_EQ(after("sets "), "flag level");
    EXPECT_EQ(after("sets flag T"), "TRUE");
    EXPECT_EQ(after("gets "), "flag level on");
    EXPECT_EQ(after("unlinkp "), "a.out b.in0");
}

TEST_F(Complete, words_of_a_choice_and_options) {
    EXPECT_EQ(after("show t"), "thread timing");
    EXPECT_EQ(after("show pin -"), "-t");
    EXPECT_EQ(after("show pin -t "), "bit float port s32 s64 u32 u64");
    EXPECT_EQ(after("show pin -t bit b.o"), "b.out");
    EXPECT_EQ(after("list sig f"), "flag");
    EXPECT_EQ(after("show param a."), "a.tmax a.tmax-increased");
    EXPECT_EQ(after("lock "), "all none tune");
    EXPECT_EQ(after("alias p"), "param pin");
    EXPECT_EQ(after("alias param a."), "a.tmax a.tmax-increased");
    EXPECT_EQ(after("unalias pin "), "start");
    EXPECT_EQ(after("newsig x f"), "float");
    EXPECT_EQ(after("fault "), "clear");
    EXPECT_EQ(after("newthread t 1000000 policy"), "policy=");
    EXPECT_EQ(after("advance 5 "), "cycles");
    EXPECT_EQ(after("help unli"), "unlinkp");
    EXPECT_EQ(after("explain two-w"), "two-writers");
}

TEST_F(Complete, components_and_files) {
    EXPECT_EQ(after("loadrt conv_bit_fl"), "conv_bit_float");
    EXPECT_EQ(after("loadrt and2 na"), "names=");
    EXPECT_EQ(after("unloadrt s"), "s sum2");
    EXPECT_EQ(after("unload a"), "a all and2");
    const Folder folder;
    folder.write("one.hal", "");
    std::filesystem::create_directory(folder.path + "/one.d");
    machine.shell.options.directory = folder.path;
    EXPECT_EQ(after("source on"), "one.d/ one.hal");
    EXPECT_EQ(after("source " + folder.path + "/one.h"), folder.path + "/one.hal");
    EXPECT_EQ(after("save all "), "one.d/ one.hal");
}

TEST_F(Complete, the_word_at_the_cursor_counts) {
    const Completion completion = machine.shell.complete("net on a.in0 b", 11);
    EXPECT_EQ(completion.begin, 7U);
    ASSERT_EQ(completion.candidates.size(), 2U);  // a.in1 goes by both its names
    EXPECT_EQ(completion.candidates[0].text, "a.in0");
    EXPECT_EQ(completion.candidates[0].hint, "bit IN");
    EXPECT_EQ(machine.shell.complete("setp", 400).begin, 0U);
    EXPECT_EQ(after("start "), "");
    EXPECT_EQ(after("nonsense "), "");
}

}  // namespace
}  // namespace hal::test
