// SPDX-License-Identifier: MIT
// Transactions: single cases.
#include "transaction_world.hpp"

namespace hal::test {
namespace {

bool has(const std::string& text, const std::string& part) {
    return text.find(part) != std::string::npos;
}

TEST(Transactions, an_unload_of_a_dead_program_is_rolled_back_with_the_rest) {
    World world;
    const std::string before = world.state();
    EXPECT_EQ(world.machine.file("net other a.in1\nsets other 1\nunload gone\nsetp nothere 1\n"),
              1);
    EXPECT_TRUE(world.machine.err.ends_with("1 error; nothing was changed\n")) << world.machine.err;
    EXPECT_EQ(world.state(), before);
    EXPECT_EQ(world.machine.file("net other a.in1\nunload gone\n"), 0) << world.machine.err;
    EXPECT_EQ(world.machine.session.model().find_component("gone"), nullptr);
}

TEST(Transactions, a_living_program_is_terminated_only_by_what_takes_effect) {
    World world;
    for (const char* line : {"unload prog", "unloadusr prog", "unload all", "unloadusr all"}) {
        EXPECT_EQ(world.machine.file(std::string("begin\n") + line + "\nsetp nothere 1\ncommit\n"),
                  1);
        EXPECT_EQ(world.machine.file(std::string(line) + "\nsetp nothere 1\n"), 1);
        const auto lock = world.machine.session.lock();
        EXPECT_FALSE(world.machine.session.programs().find("prog")->stopping) << line;
    }
    EXPECT_EQ(world.machine.file("begin\nnewsig new bit\nunload prog\ncommit\n"), 0)
        << world.machine.err;
    world.state();  // when it has ended
    EXPECT_EQ(world.machine.session.model().find_component("prog"), nullptr)
        << "it was asked to end: nothing of it remains";
}

TEST(Transactions, what_cannot_be_part_of_one_is_rejected_and_leaves_it_open) {
    World world;
    ASSERT_EQ(world.machine.line("begin"), 0);
    ASSERT_EQ(world.machine.line("newsig new bit"), 0);
    for (const char* line :
         {"loadusr -w true", "waitusr prog", "frobnicate", "source bad.hal", "begin"}) {
        EXPECT_EQ(world.machine.line(line), line == std::string("source bad.hal") ? 0 : 1) << line;
        EXPECT_TRUE(world.machine.shell.collecting()) << line;
    }
    ASSERT_EQ(world.machine.line("abort"), 0);
    ASSERT_EQ(world.machine.line("begin"), 0);
    ASSERT_EQ(world.machine.line("newsig new bit"), 0);
    ASSERT_EQ(world.machine.line("stop"), 0);
    EXPECT_EQ(world.machine.line("start"), 1);
    EXPECT_TRUE(has(world.machine.err, "'start' and 'stop' cannot be in the same transaction"))
        << world.machine.err;
    EXPECT_EQ(world.machine.line("commit"), 0) << world.machine.err;
    EXPECT_FALSE(world.machine.session.threads().running());
    EXPECT_NE(world.machine.session.model().find_signal("new"), nullptr);
}

TEST(Transactions, locks_count_from_their_line_and_take_effect_with_the_rest) {
    World world;
    EXPECT_EQ(world.machine.file("begin\nlock all\nnewsig late bit\ncommit\n"), 1);
    EXPECT_TRUE(has(world.machine.err, "[locked]")) << world.machine.err;
    EXPECT_EQ(world.machine.session.locked, 0U);
    EXPECT_EQ(world.machine.file("setp a.in0 0\nlock all\n"), 0) << world.machine.err;
    EXPECT_EQ(world.machine.session.locked, 255U);
    EXPECT_EQ(world.machine.file("unlock\nsetp a.in0 1\n"), 0) << world.machine.err;
    EXPECT_EQ(world.machine.session.locked, 0U);
}

TEST(Transactions, a_command_that_looks_sees_the_edits_made_so_far_and_does_not_end_them) {
    World world;
    const std::string before = world.state();
    EXPECT_EQ(world.machine.file("setp a.in0 0\ngetp a.in0\nnewsig new float\nsets new 3\ngets "
                                 "new\nlist comp x\nshow thread\nsave\nstatus\nsetp nothere 1\n"),
              1);
    EXPECT_TRUE(world.machine.out.starts_with("FALSE\n3\n")) << world.machine.out;
    EXPECT_TRUE(has(world.machine.out, "newsig new float")) << world.machine.out;
    EXPECT_TRUE(world.machine.err.ends_with("1 error; nothing was changed\n")) << world.machine.err;
    EXPECT_EQ(world.state(), before);
    EXPECT_EQ(world.machine.file("setp nothere 1\nshow pin\n"), 1);
    EXPECT_EQ(world.machine.out, "") << "it would show what is rolled back";
    EXPECT_EQ(world.machine.file("newsig new float\ngetp nothere\nnewsig more bit\n"), 1);
    EXPECT_EQ(world.state(), before);
}

TEST(Transactions, the_last_line_names_the_lines_that_took_effect) {
    World world;
    EXPECT_EQ(world.machine.file("# a comment\nnewsig one bit\n\nnewsig two bit\nstop\nnewsig "
                                 "three bit\nsetp nothere 1\nstart\n"),
              1);
    EXPECT_TRUE(world.machine.err.ends_with(
        "1 error; lines 2 to 5 took effect; lines 6 to 8 had no effect\n"))
        << world.machine.err;
    world.folder.write("inner.hal", "newsig four bit\nstart\nsetp nothere 1\nnewsig five bit\n");
    EXPECT_EQ(world.machine.file("newsig six bit\nsource inner.hal\nnewsig seven bit\n"), 1);
    EXPECT_TRUE(
        has(world.machine.err, "; line 1 of test.hal, lines 1 to 2 of " + world.folder.path +
                                   "/inner.hal took effect; lines 3 to 4 of " + world.folder.path +
                                   "/inner.hal, line 3 of test.hal had no effect\n"))
        << world.machine.err;
    EXPECT_EQ(world.machine.file("newsig eight bit\nloadusr -w false\nnewsig nine bit\n"), 1);
    EXPECT_TRUE(world.machine.err.ends_with("1 error; line 1 took effect; line 3 had no effect\n"))
        << world.machine.err;
    EXPECT_EQ(world.machine.file("newsig ten bit\nstart\nbegin\nnewsig x bit\nabort\nnewsig eleven "
                                 "bit\nstart\nsetp nothere 1\n"),
              1);
    EXPECT_TRUE(world.machine.err.ends_with(
        "1 error; lines 1 to 2 and 6 to 7 took effect; lines 4 and 8 had no effect\n"))
        << world.machine.err;
}

TEST(Transactions, verbs_of_the_protocol_respect_the_begin_of_their_connection) {
    World world;
    const std::string before = world.state();
    auto client = std::make_unique<Connection>(world.machine.shell, ::getpid());
    World::run(*client, "begin");
    EXPECT_TRUE(has(World::ask(*client, R"({"set":{"a.in0":false,"free":8}})"),
                    R"("count":2,"collecting":true)"));
    EXPECT_TRUE(has(World::ask(*client, R"({"component":"mine"})"), "open 'begin'"));
    EXPECT_TRUE(has(World::ask(*world.alive, R"({"set":{"a.in1":true}})"), "\"count\":1"))
        << "another connection is not concerned";
    World::ask(*world.alive, R"({"set":{"a.in1":false}})");
    EXPECT_EQ(world.state(), before);
    client.reset();
    EXPECT_EQ(world.state(), before) << "a client that dies inside begin";
    client = std::make_unique<Connection>(world.machine.shell, ::getpid());
    World::run(*client, "begin");
    World::ask(*client, R"({"set":{"a.in0":false,"free":8}})");
    EXPECT_TRUE(has(World::run(*client, "commit"), "\"status\":0"));
    EXPECT_EQ(world.machine.says("getp a.in0"), "FALSE\n");
    EXPECT_EQ(world.machine.says("gets free"), "8\n");
}

TEST(Transactions, a_component_request_that_is_rejected_leaves_a_dead_program_as_it_was) {
    World world;
    const std::string before = world.state();
    Connection client(world.machine.shell, ::getpid());
    EXPECT_TRUE(has(
        World::ask(
            client,
            R"({"component":"gone","pins":[{"name":"out","type":"float","dir":"out"},{"name":"new","type":"bit","dir":"in"},{"name":"new","type":"bit","dir":"in"}]})"),
        "\"ok\":false"));
    EXPECT_EQ(world.state(), before);
}

}  // namespace
}  // namespace hal::test
