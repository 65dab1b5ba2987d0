// SPDX-License-Identifier: MIT
// The index of names that messages offer: the same answers as the plain search, at a fraction of
// its cost.
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <random>
#include <stop_token>
#include <string>
#include <vector>

#include "text/sort_in_steps.hpp"
#include "text/suggest.hpp"

namespace hal::test {
namespace {

TEST(NameIndex, finds_what_the_plain_search_finds) {
    std::mt19937 random(30);
    const auto number = [&](int below) {
        return static_cast<int>(random() % static_cast<unsigned>(below));
    };
    const auto word = [&](int max) {
        std::string text;
        for (int i = number(max + 1); i > 0; --i) {
            text += "abcAB.-_01"[number(10)];
        }
        return text;
    };
    for (int round = 0; round < 60; ++round) {
        std::vector<std::string> names;
        NameIndex index;
        for (int i = number(200); i > 0; --i) {
            names.push_back(word(3) + "." + std::to_string(i) + "." + word(round % 12));
            index.add(names.back());
        }
        for (int i = 0; i < 60; ++i) {
            std::string wanted =
                names.empty() || number(4) == 0
                    ? word(12)
                    : names[static_cast<std::size_t>(number(static_cast<int>(names.size())))];
            for (int edit = number(4); edit > 0 && !wanted.empty(); --edit) {
                const auto at = static_cast<std::size_t>(number(static_cast<int>(wanted.size())));
                if (number(3) == 0) {
                    wanted.erase(at, 1);
                } else if (number(2) == 0) {
                    wanted.insert(at, 1, 'c');
                } else {
                    std::swap(wanted[at], wanted[wanted.size() / 2]);
                }
            }
            const auto count = static_cast<std::size_t>(1 + number(5));
            EXPECT_EQ(index.similar(wanted, count), similar(wanted, names, count)) << wanted;
        }
    }
}

TEST(NameIndex, a_search_among_many_names_compares_few_of_them) {
    NameIndex index;
    for (int i = 0; i < 2500; ++i) {
        for (const char* pin : {"command",        "feedback", "output", "error",     "Pgain",
                                "Igain",          "Dgain",    "enable", "saturated", "bias",
                                "maxoutput",      "deadband", "errorI", "errorD",    "index-enable",
                                "feedback-deriv", "FF0",      "FF1",    "FF2",       "maxerror"}) {
            index.add("pid." + std::to_string(i) + "." + pin);
        }
    }
    EXPECT_EQ(did_you_mean("pid.1207.outptu", index), "did you mean 'pid.1207.output'?");
    const std::uint64_t once = index.steps();
    for (int i = 0; i < 99; ++i) {
        index.similar("pid." + std::to_string(i) + ".outputt");
    }
    // characters that the plain search compares
    const std::uint64_t plain = 100ULL * index.size() * 15;
    EXPECT_LT(index.steps(), plain / 3) << once;
}

TEST(NameIndex, a_search_can_be_limited_to_older_names) {
    NameIndex index;
    index.add("a.out", 1);
    index.add("b.out", 7);
    EXPECT_EQ(index.similar("x.out"), (std::vector<std::string>{"a.out", "b.out"}));
    EXPECT_EQ(index.similar("x.out", 3, 7), (std::vector<std::string>{"a.out"}));
    EXPECT_TRUE(index.similar("x.out", 3, 1).empty());
}

TEST(NameIndex, a_search_that_is_stopped_offers_nothing_and_compares_nothing) {
    NameIndex index;
    for (int i = 0; i < 20'000; ++i) {
        index.add("pid." + std::to_string(i) + ".output");
    }
    std::stop_source stop;
    EXPECT_EQ(index.similar("pid.7.outputt", 1, NameIndex::all, stop.get_token()),
              (std::vector<std::string>{"pid.7.output"}));
    const std::uint64_t steps = index.steps();
    stop.request_stop();
    EXPECT_TRUE(index.similar("pid.7.outputt", 1, NameIndex::all, stop.get_token()).empty());
    EXPECT_EQ(index.steps(), steps);
    EXPECT_EQ(did_you_mean("pid.7.outputt", index, NameIndex::all, stop.get_token()), "");
}

TEST(NameIndex, an_index_whose_sorting_was_stopped_is_empty) {
    NameIndex index;
    for (int i = 0; i < 20'000; ++i) {
        index.add("pid." + std::to_string(i) + ".output");
    }
    std::stop_source stop;
    stop.request_stop();
    EXPECT_TRUE(index.similar("pid.7.outputt", 1, NameIndex::all, stop.get_token()).empty());
    EXPECT_TRUE(index.similar("pid.7.outputt").empty());
    EXPECT_EQ(index.size(), 0U);
}

TEST(SortInSteps, sorts_rows_of_any_length_unless_it_is_stopped) {
    std::mt19937 random(7);
    for (const std::size_t size : {0U, 1U, 4095U, 4096U, 4097U, 12'289U, 50'000U}) {
        std::vector<unsigned> row(size);
        std::generate(row.begin(), row.end(), [&] { return static_cast<unsigned>(random()); });
        std::vector<unsigned> sorted = row;
        std::sort(sorted.begin(), sorted.end());
        sort_in_steps(row, std::less<>(), [] { return false; });
        EXPECT_EQ(row, sorted);
    }
    for (int after = 0; after < 20; ++after) {
        std::vector<unsigned> row(50'000);
        int asked = 0;
        sort_in_steps(row, std::less<>(), [&] { return asked++ == after; });
        EXPECT_TRUE(row.empty());
        EXPECT_EQ(asked, after + 1) << "and nothing is sorted afterwards";
    }
}

}  // namespace
}  // namespace hal::test
