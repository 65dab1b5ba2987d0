// SPDX-License-Identifier: MIT
#include <future>
#include <gtest/gtest.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include "tools/cli/editor.hpp"
#include "tools/cli/prompt_loop.hpp"

namespace hal::tools {
namespace {

struct Pipe {
    int ends[2];
    Pipe() { EXPECT_EQ(::pipe(ends), 0); }
    ~Pipe() {
        ::close(ends[0]);
        finish();
    }
    void write(const std::string& text) {
        ASSERT_EQ(::write(ends[1], text.data(), text.size()), static_cast<ssize_t>(text.size()));
    }
    void finish() {
        if (ends[1] >= 0) {
            ::close(ends[1]);
        }
        ends[1] = -1;
    }
};

TEST(LineReader, gives_lines_as_they_come_and_a_last_one_without_end) {
    Pipe pipe;
    LineReader reader(pipe.ends[0]);
    std::string line;
    pipe.write("one\n\ntw");
    EXPECT_TRUE(reader.read(line));
    EXPECT_EQ(line, "one");
    EXPECT_TRUE(reader.waiting());
    EXPECT_TRUE(reader.read(line));
    EXPECT_EQ(line, "");
    EXPECT_FALSE(reader.waiting());
    pipe.write("o\nthree");
    EXPECT_TRUE(reader.read(line));
    EXPECT_EQ(line, "two");
    pipe.finish();
    EXPECT_TRUE(reader.read(line));
    EXPECT_EQ(line, "three");
    EXPECT_FALSE(reader.read(line));
    EXPECT_FALSE(reader.read(line));
}

TEST(LineReader, keeps_a_line_longer_than_its_buffer) {
    Pipe pipe;
    const std::string max(300'000, 'x');
    auto writer = std::async(std::launch::async, [&] {
        pipe.write(max + "\nend\n");
        pipe.finish();
    });
    LineReader reader(pipe.ends[0]);
    std::string line;
    EXPECT_TRUE(reader.read(line));
    EXPECT_EQ(line, max);
    EXPECT_TRUE(reader.read(line));
    EXPECT_EQ(line, "end");
    writer.get();
}

TEST(LineReader, stops_when_told_while_it_waits) {
    Pipe pipe;
    const int stop = ::eventfd(0, 0);
    auto reading = std::async(std::launch::async, [&] {
        std::string line;
        return LineReader(pipe.ends[0], stop).read(line);
    });
    const std::uint64_t one = 1;
    ASSERT_EQ(::write(stop, &one, sizeof one), static_cast<ssize_t>(sizeof one));
    EXPECT_FALSE(reading.get());
    ::close(stop);
}

TEST(CommonPrefix, is_what_all_candidates_begin_with) {
    EXPECT_EQ(common_prefix({}), "");
    EXPECT_EQ(common_prefix({{"abc", ""}}), "abc");
    EXPECT_EQ(common_prefix({{"pid.0.in", ""}, {"pid.0.ix", ""}, {"pid.1", ""}}), "pid.");
    EXPECT_EQ(common_prefix({{"a", ""}, {"b", ""}}), "");
    EXPECT_EQ(common_prefix({{"ab", ""}, {"a", ""}}), "a");
}

TEST(CandidateTable, fills_the_width_column_by_column) {
    EXPECT_EQ(candidate_table({{"a", "bit"}, {"bb", "s32"}, {"c", ""}}, 24),
              "a   bit   c\nbb  s32\n");
    EXPECT_EQ(candidate_table({{"a", ""}, {"bb", ""}}, 1), "a\nbb\n");
}

TEST(CandidateTable, says_how_many_it_leaves_out) {
    std::vector<Candidate> many(250, Candidate{"name", ""});
    EXPECT_NE(candidate_table(many, 80).find("… and 50 more\n"), std::string::npos);
}

}  // namespace
}  // namespace hal::tools
