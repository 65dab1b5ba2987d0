// SPDX-License-Identifier: MIT
// The options of a command: what reading a command line makes of them, and their help.
#include <algorithm>
#include <gtest/gtest.h>

#include "tools/cli/option_set.hpp"

using namespace hal::tools;

namespace {

struct SampleOptions : Options {
    std::string file;
    std::vector<std::string> names;
    std::int64_t for_ns = -1;
    double factor = 1.0;
    int level = 0;
    bool loud = false;

    void declare(OptionSet& set) override {
        set.words("WORD", "what to do");
        set.value("-f,--file", file, "FILE", "a file");
        set.values("--name", names, "NAME", "a name; may be repeated");
        set.for_how_long(for_ns, "end after 2s");
        set.value("--factor", factor, "F", "a factor");
        set.value("--level", level, "N", "a level").in(0, 3);
        set.flag("-l,--loud", loud, "with noise");
    }
};

struct OptionSetTest : testing::Test {
    SampleOptions options;
    OptionSet set{options, "sample", "an example"};
};

TEST_F(OptionSetTest, fills_the_members) {
    const auto reading =
        set.read({"one", "-l", "--name", "a", "--name", "b", "--for", "2s", "-f", "x", "two"});
    EXPECT_EQ(reading.outcome, OptionSet::Outcome::good);
    EXPECT_TRUE(reading.extra.empty());
    EXPECT_EQ(options.words, (std::vector<std::string>{"one", "two"}));
    EXPECT_EQ(options.names, (std::vector<std::string>{"a", "b"}));
    EXPECT_EQ(options.for_ns, 2'000'000'000);
    EXPECT_EQ(options.file, "x");
    EXPECT_TRUE(options.loud);
}

TEST_F(OptionSetTest, reports_missing_words) {
    EXPECT_EQ(set.read({"-l"}).outcome, OptionSet::Outcome::missing);
}

TEST_F(OptionSetTest, reports_a_request_for_help) {
    EXPECT_EQ(set.read({"--help"}).outcome, OptionSet::Outcome::help);
}

TEST_F(OptionSetTest, names_the_option_and_the_invalid_value) {
    EXPECT_EQ(set.read({"one", "--factor", "fast"}).problem, "--factor: 'fast' is not a number");
    EXPECT_EQ(set.read({"one", "--factor", "x"}).problem, "--factor: 'x' is not a number");
    EXPECT_EQ(set.read({"one", "--for", "long"}).problem,
              "--for: invalid duration 'long'; use 10s, 250ms or 2min");
    // the rest is the library's
    EXPECT_TRUE(
        set.read({"one", "--level", "7"}).problem.starts_with("--level: Value 7 not in range "));
}

TEST_F(OptionSetTest, returns_what_no_declaration_takes) {
    EXPECT_EQ(set.read({"one", "--lout"}).extra, std::vector<std::string>{"--lout"});
}

TEST_F(OptionSetTest, lists_the_options_as_they_are_typed) {
    const auto names = set.names();
    for (const char* name : {"--file", "-f", "--name", "--for", "--factor", "--level", "--loud",
                             "-l", "--help", "-h"}) {
        EXPECT_NE(std::find(names.begin(), names.end(), name), names.end()) << name;
    }
}

TEST_F(OptionSetTest, shows_words_values_and_ranges_in_the_help) {
    EXPECT_EQ(set.help(),
              "\n  WORD                     what to do\n"
              "  -f, --file FILE          a file\n"
              "  --name NAME              a name; may be repeated\n"
              "  --for TIME               end after 2s\n"
              "  --factor F               a factor\n"
              "  --level N:0..3           a level\n"
              "  -l, --loud               with noise\n"
              "  -h, --help               print this\n");
}

}  // namespace
