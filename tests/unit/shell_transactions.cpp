// SPDX-License-Identifier: MIT
// The property of all edits: whatever stands in a text or between begin and commit, a failure leaves the machine as it was, or
// exactly as the lines make it that the message names. Model, values, programs, locks and threads are compared.
#include "shell_machine.hpp"

#include <csignal>
#include <memory>
#include <random>
#include <regex>
#include <sstream>
#include <vector>

#include <sys/wait.h>

#include "machine/processes.hpp"
#include "control/connection.hpp"

namespace hal::test {
namespace {

bool has(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

/// A machine with a bit of everything: linked programs, one alive and one dead, aliases, values, two threads, running.
struct World {
    World() {
        folder.write("good.hal", "newsig sourced bit\nsetp s.gain1 4\n");
        folder.write("bad.hal", "newsig sourced bit\nsetp nothere 1\n");
        machine.shell.options.directory = folder.path;
        machine.must("loadrt and2 names=a,b\nloadrt not names=n,spare\nloadrt sum2 names=s\nnewthread fast 1000000\nnewthread slow 4000000\n"
                     "addf a fast\naddf n fast\naddf s slow\nnet link a.out => n.in\nnewsig free float\nsets free 2\nalias pin b.in0 second\n"
                     "setp a.in0 1\nsetp s.gain0 2\nloadusr sleep 1000\nstart\nadvance 5 cycles\n");
        {
            const std::scoped_lock lock(machine.session.mutex);
            child = machine.shell.processes().find("sleep")->pid;
        }
        alive = std::make_unique<Connection>(machine.shell, child);
        EXPECT_TRUE(has(ask(*alive, R"({"component":"prog","pins":[{"name":"out","type":"bit","dir":"out"}]})"), "\"ok\":true"));
        {
            Connection dies(machine.shell, ::getpid());
            EXPECT_TRUE(has(ask(dies, R"({"component":"gone","pins":[{"name":"out","type":"float","dir":"out","value":3,"safe":0}],"timeout_ms":-1})"),
                            "\"ok\":true"));
        }
        machine.must("net of-prog prog.out => b.in1\nnet of-gone gone.out => s.in0\nadvance 3 cycles\n");
    }

    static std::string ask(Connection& connection, const std::string& request) {
        std::string reply;
        connection.handle(request, reply, true);
        return reply;
    }
    static std::string run(Connection& connection, const std::string& line) {
        std::string quoted;
        for (const char c : line) quoted += c == '"' ? "\\\"" : std::string(1, c);
        return ask(connection, "{\"run\":\"" + quoted + "\"}");
    }

    std::string state() {
        std::string text;
        {
            std::unique_lock lock(machine.session.mutex);
            Processes& processes = machine.shell.processes();
            const auto ending = [&] {
                for (const std::string& name : processes.names())
                    if (const auto* const entry = processes.find(name); entry->stopping && entry->child && !entry->ended) return true;
                return false;
            };
            while (ending()) processes.wait(lock, std::chrono::milliseconds(20));
            for (const std::string& name : processes.names()) text += name + (processes.find(name)->dead() ? " dead\n" : " alive\n");
            text += "locks " + std::to_string(machine.session.lock) + (machine.session.running() ? " running\n" : " stopped\n");
            EXPECT_FALSE(machine.session.in_transaction());
        }
        TextOutput output;
        Shell reader(machine.shell, {});
        for (const char* line : {"save allu", "list comp", "list pin", "list param", "list funct", "list thread", "save signalvalues"})
            reader.execute(line, output);
        return text + output.out_text + output.err_text;
    }
    bool child_lives() const { return ::kill(child, 0) == 0; }

    Folder folder;
    ShellMachine machine;
    pid_t child = 0;
    std::unique_ptr<Connection> alive;  // before the machine
};

/// A world that is made anew after a change.
class Worlds {
public:
    World& fresh() {
        if (!world_) {
            world_ = std::make_unique<World>();
            before_ = world_->state();
            ++made;
        }
        return *world_;
    }
    const std::string& before() const { return before_; }
    void changed() { world_.reset(); }
    int made = 0;

private:
    std::unique_ptr<World> world_;
    std::string before_;
};

const std::vector<std::string> edits{
    "loadrt and2 names=x", "loadrt not count=2", "unloadrt b", "unload spare", "unload and2", "unload gone", "unload prog", "unload all", "unloadrt all",
    "reload not", "newthread third 8000000", "delthread slow", "addf spare slow", "addf spare fast 1", "addf --auto slow", "delf a fast", "initf b slow",
    "net new n.out => b.in0", "net link b.in0", "newsig another u32", "delsig link", "delsig all", "linkps s.out free", "linksp free s.in1", "linkpp n.out b.in0",
    "unlinkp n.in", "unlinkp prog.out", "unlinkp gone.out", "setp a.in0 0", "s.gain0 = 7", "setp s.offset -1", "sets free 9", "alias param s.gain0 factor",
    "alias pin prog.out pin-of-prog", "unalias pin second", "lock", "lock tune", "unlock", "unloadusr prog", "unloadusr gone", "unloadusr all", "fault clear",
    "source good.hal"};
const std::vector<std::string> looks{"show", "show comp", "show pin", "show thread", "show timing", "show latency", "show fault", "list sig", "status", "save", "save signalvalues", "getp a.in0",
                                     "gets free", "ptype a.in0", "stype free", "print hello", "help net", "explain two-writers", "echo", "unecho", "debug 1"};
const std::vector<std::string> acts{"start", "stop"};
const std::vector<std::string> outside{"advance 3 cycles", "loadusr -w true", "loadusr sleep 1000", "waitusr nobody", "save all saved.hal"};
const std::vector<std::string> failures{"setp nothere 1", "frobnicate", "loadrt nowhere"};
const std::vector<std::string> fillers{"newsig f1 bit", "setp s.gain1 3", "net f2 spare.out", "newthread f3 16000000"};

std::vector<std::string> with(const std::string& command, std::size_t position, const std::string& failure) {
    std::vector<std::string> lines = fillers;
    lines.insert(lines.begin() + static_cast<std::ptrdiff_t>(position), command);
    if (!failure.empty()) lines.push_back(failure);
    return lines;
}

std::string joined(const std::vector<std::string>& lines) {
    std::string text;
    for (const std::string& line : lines) text += line + "\n";
    return text;
}

/// The numbers in front of "took effect" in the last line of what was printed.
std::vector<std::size_t> named_lines(const std::string& err) {
    std::vector<std::size_t> named;
    const auto end = err.rfind(" took effect");
    if (end == std::string::npos) return named;
    std::string row = err.substr(0, end);
    row = row.substr(std::min(row.rfind("; ") == std::string::npos ? 0 : row.rfind("; ") + 2, row.size()));
    static const std::regex run("([0-9]+)( to ([0-9]+))?");
    for (std::sregex_iterator at(row.begin(), row.end(), run), none; at != none; ++at) {
        const std::size_t first = std::stoul((*at)[1]), last = (*at)[3].matched ? std::stoul((*at)[3]) : first;
        for (std::size_t line = first; line <= last; ++line) named.push_back(line);
    }
    return named;
}

struct Property : testing::Test {
    Worlds worlds;
    int combinations = 0;

    void file(const std::vector<std::string>& lines) {
        World& world = worlds.fresh();
        ++combinations;
        const int status = world.machine.file(joined(lines));
        ASSERT_EQ(status, 1) << joined(lines);
        const std::string err = world.machine.err, after = world.state();
        const bool lives = world.child_lives();
        if (after != worlds.before()) worlds.changed();
        if (err.ends_with("nothing was changed\n")) {
            ASSERT_EQ(after, worlds.before()) << joined(lines) << err;
            ASSERT_TRUE(lives) << joined(lines) << err;
            return;
        }
        std::vector<std::string> effective;
        for (const std::size_t line : named_lines(err)) {
            ASSERT_LE(line, lines.size()) << err;
            effective.push_back(lines[line - 1]);
        }
        ASSERT_FALSE(effective.empty()) << joined(lines) << err;
        ASSERT_TRUE(has(err, " had no effect\n")) << joined(lines) << err;
        worlds.changed();
        World& other = worlds.fresh();
        ASSERT_EQ(other.machine.file(joined(effective)), 0) << joined(effective) << "of\n" << joined(lines) << err << other.machine.err;
        const std::string wanted = other.state();
        if (wanted != worlds.before()) worlds.changed();
        ASSERT_EQ(after, wanted) << joined(lines) << err;
    }

    void grouped(const std::vector<std::string>& lines, bool as_file) {
        World& world = worlds.fresh();
        ++combinations;
        std::string said;
        if (as_file) {
            ASSERT_EQ(world.machine.file("begin\n" + joined(lines) + "commit\n"), 1) << joined(lines);
            said = world.machine.err;
            ASSERT_TRUE(said.ends_with("nothing was changed\n")) << joined(lines) << said;
        } else {
            Connection client(world.machine.shell, ::getpid());
            World::run(client, "begin");
            for (const std::string& line : lines) {
                const std::string reply = World::run(client, line);
                ASSERT_TRUE(has(reply, "\"collecting\":true")) << line << reply;
            }
            ASSERT_EQ(world.state(), worlds.before()) << "before the commit\n" << joined(lines);
            said = World::run(client, "commit");
        }
        const std::string after = world.state();
        const bool lives = world.child_lives();
        if (after != worlds.before()) worlds.changed();
        // by lines, what is rejected where it is typed leaves the transaction, which may then be a good one
        if (!as_file && has(said, "\"status\":0")) return worlds.changed();
        ASSERT_EQ(after, worlds.before()) << joined(lines) << said;
        ASSERT_TRUE(lives) << joined(lines) << said;
    }
};

TEST_F(Property, a_file_that_fails_changes_nothing_or_what_its_message_names) {
    for (const auto* const kind : {&edits, &looks, &acts, &outside})
        for (const std::string& command : *kind)
            for (std::size_t position = 0; position <= fillers.size(); ++position)
                for (const std::string& failure : failures) {
                    file(with(command, position, failure));
                    if (HasFatalFailure()) return;
                }
    RecordProperty("combinations", combinations);
    RecordProperty("worlds", worlds.made);
    EXPECT_GT(combinations, 1000);
}

TEST_F(Property, a_begin_that_fails_changes_nothing) {
    for (const auto* const kind : {&edits, &looks, &acts, &outside})
        for (const std::string& command : *kind)
            for (std::size_t position = 0; position <= fillers.size(); ++position)
                for (const std::string& failure : failures)
                    for (const bool as_file : {true, false}) {
                        if (command == "save all saved.hal" || command == "debug 1" || command.starts_with("advance")) continue;  // they act at once
                        if (!as_file && failure == "frobnicate") continue;  // rejected where it is typed
                        grouped(with(command, position, failure), as_file);
                        if (HasFatalFailure()) return;
                    }
    RecordProperty("combinations", combinations);
    RecordProperty("worlds", worlds.made);
    EXPECT_GT(combinations, 1500);
}

TEST_F(Property, a_commit_does_what_its_lines_do_one_by_one) {
    for (const auto* const kind : {&edits, &acts})
        for (const std::string& command : *kind) {
            const auto lines = with(command, 2, "");
            const int expected = worlds.fresh().machine.file(joined(lines));
            const std::string wanted = worlds.fresh().state();
            worlds.changed();
            const int status = worlds.fresh().machine.file("begin\n" + joined(lines) + "commit\n");
            EXPECT_EQ(status, expected) << joined(lines) << worlds.fresh().machine.err;
            EXPECT_EQ(worlds.fresh().state(), wanted) << joined(lines);
            worlds.changed();
        }
}

// Two clients, line by line; each may be in a begin of its own, and one dies now and then.
TEST_F(Property, random_lines_of_two_clients_change_all_or_nothing) {
    std::mt19937 random(12);
    const auto one_of = [&](const std::vector<std::string>& all) { return all[random() % all.size()]; };
    int refused = 0, taken = 0;
    for (int sequence = 0; sequence < 60; ++sequence) {
        World& world = worlds.fresh();
        std::unique_ptr<Connection> clients[2];
        bool collecting[2] = {false, false};
        std::string before = world.state(), history;
        for (int step = 0; step < 25; ++step) {
            const std::size_t who = random() % 2;
            if (!clients[who]) clients[who] = std::make_unique<Connection>(world.machine.shell, ::getpid());
            const auto what = random() % 20;
            std::string line = what < 2   ? "begin"
                               : what < 4 ? "commit"
                               : what < 5 ? "abort"
                               : what < 7 ? one_of(failures)
                               : what < 8 ? "source bad.hal"
                               : what < 10 ? one_of(looks)
                               : what < 11 ? one_of(acts)
                               : what < 12 ? one_of(fillers)
                                           : one_of(edits);
            if (what == 19) {
                history += std::to_string(who) + " dies\n";
                clients[who].reset();
                collecting[who] = false;
                ASSERT_EQ(world.state(), before) << history;
                continue;
            }
            history += std::to_string(who) + " " + line + "\n";
            const std::string reply = World::run(*clients[who], line);
            const std::string after = world.state();
            const bool now = has(reply, "\"collecting\":true"), good = has(reply, "\"status\":0");
            if (!good) {
                ++refused;
                ASSERT_EQ(after, before) << history << reply;
            } else if (collecting[who] && line != "commit") {
                ASSERT_EQ(after, before) << history << reply;
            } else {
                taken += after != before;
            }
            collecting[who] = now;
            before = after;
        }
        clients[0].reset();
        clients[1].reset();
        ASSERT_EQ(world.state(), before) << history;
        worlds.changed();
    }
    RecordProperty("refused", refused);
    RecordProperty("taken", taken);
    EXPECT_GT(refused, 100);
    EXPECT_GT(taken, 100);
}

// --- single cases ------------------------------------------------------------------------------------------------------------

TEST(Transactions, an_unload_of_a_dead_program_is_rolled_back_with_the_rest) {
    World world;
    const std::string before = world.state();
    EXPECT_EQ(world.machine.file("net other a.in1\nsets other 1\nunload gone\nsetp nothere 1\n"), 1);
    EXPECT_TRUE(world.machine.err.ends_with("1 error; nothing was changed\n")) << world.machine.err;
    EXPECT_EQ(world.state(), before);
    EXPECT_EQ(world.machine.file("net other a.in1\nunload gone\n"), 0) << world.machine.err;
    EXPECT_EQ(world.machine.session.model().find_component("gone"), nullptr);
}

TEST(Transactions, a_living_program_is_terminated_only_by_what_takes_effect) {
    World world;
    for (const char* line : {"unload prog", "unloadusr prog", "unload all", "unloadusr all"}) {
        EXPECT_EQ(world.machine.file(std::string("begin\n") + line + "\nsetp nothere 1\ncommit\n"), 1);
        EXPECT_EQ(world.machine.file(std::string(line) + "\nsetp nothere 1\n"), 1);
        const std::scoped_lock lock(world.machine.session.mutex);
        EXPECT_FALSE(world.machine.shell.processes().find("prog")->stopping) << line;
    }
    EXPECT_EQ(world.machine.file("begin\nnewsig new bit\nunload prog\ncommit\n"), 0) << world.machine.err;
    world.state();  // when it has ended
    EXPECT_EQ(world.machine.session.model().find_component("prog"), nullptr) << "it was told to end: nothing of it stays";
}

TEST(Transactions, what_cannot_be_part_of_one_is_rejected_and_leaves_it_open) {
    World world;
    ASSERT_EQ(world.machine.line("begin"), 0);
    ASSERT_EQ(world.machine.line("newsig new bit"), 0);
    for (const char* line : {"loadusr -w true", "waitusr prog", "frobnicate", "source bad.hal", "begin"}) {
        EXPECT_EQ(world.machine.line(line), line == std::string("source bad.hal") ? 0 : 1) << line;
        EXPECT_TRUE(world.machine.shell.collecting()) << line;
    }
    ASSERT_EQ(world.machine.line("abort"), 0);
    ASSERT_EQ(world.machine.line("begin"), 0);
    ASSERT_EQ(world.machine.line("newsig new bit"), 0);
    ASSERT_EQ(world.machine.line("stop"), 0);
    EXPECT_EQ(world.machine.line("start"), 1);
    EXPECT_TRUE(has(world.machine.err, "'start' and 'stop' cannot be in the same transaction")) << world.machine.err;
    EXPECT_EQ(world.machine.line("commit"), 0) << world.machine.err;
    EXPECT_FALSE(world.machine.session.running());
    EXPECT_NE(world.machine.session.model().find_signal("new"), nullptr);
}

TEST(Transactions, locks_count_from_their_line_and_take_effect_with_the_rest) {
    World world;
    EXPECT_EQ(world.machine.file("begin\nlock all\nnewsig late bit\ncommit\n"), 1);
    EXPECT_TRUE(has(world.machine.err, "[locked]")) << world.machine.err;
    EXPECT_EQ(world.machine.session.lock, 0U);
    EXPECT_EQ(world.machine.file("setp a.in0 0\nlock all\n"), 0) << world.machine.err;
    EXPECT_EQ(world.machine.session.lock, 255U);
    EXPECT_EQ(world.machine.file("unlock\nsetp a.in0 1\n"), 0) << world.machine.err;
    EXPECT_EQ(world.machine.session.lock, 0U);
}

TEST(Transactions, a_command_that_looks_sees_the_edits_made_so_far_and_does_not_end_them) {
    World world;
    const std::string before = world.state();
    EXPECT_EQ(world.machine.file("setp a.in0 0\ngetp a.in0\nnewsig new float\nsets new 3\ngets new\nlist comp x\nshow thread\nsave\nstatus\nsetp nothere 1\n"), 1);
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
    EXPECT_EQ(world.machine.file("# a comment\nnewsig one bit\n\nnewsig two bit\nstop\nnewsig three bit\nsetp nothere 1\nstart\n"), 1);
    EXPECT_TRUE(world.machine.err.ends_with("1 error; lines 2 to 5 took effect; lines 6 to 8 had no effect\n")) << world.machine.err;
    world.folder.write("inner.hal", "newsig four bit\nstart\nsetp nothere 1\nnewsig five bit\n");
    EXPECT_EQ(world.machine.file("newsig six bit\nsource inner.hal\nnewsig seven bit\n"), 1);
    EXPECT_TRUE(has(world.machine.err, "; line 1 of test.hal, lines 1 to 2 of " + world.folder.path + "/inner.hal took effect; lines 3 to 4 of " + world.folder.path +
                                           "/inner.hal, line 3 of test.hal had no effect\n"))
        << world.machine.err;
    EXPECT_EQ(world.machine.file("newsig eight bit\nloadusr -w false\nnewsig nine bit\n"), 1);
    EXPECT_TRUE(world.machine.err.ends_with("1 error; line 1 took effect; line 3 had no effect\n")) << world.machine.err;
    EXPECT_EQ(world.machine.file("newsig ten bit\nstart\nbegin\nnewsig x bit\nabort\nnewsig eleven bit\nstart\nsetp nothere 1\n"), 1);
    EXPECT_TRUE(world.machine.err.ends_with("1 error; lines 1 to 2 and 6 to 7 took effect; lines 4 and 8 had no effect\n")) << world.machine.err;
}

TEST(Transactions, verbs_of_the_protocol_respect_the_begin_of_their_connection) {
    World world;
    const std::string before = world.state();
    auto client = std::make_unique<Connection>(world.machine.shell, ::getpid());
    World::run(*client, "begin");
    EXPECT_TRUE(has(World::ask(*client, R"({"set":{"a.in0":false,"free":8}})"), R"("count":2,"collecting":true)"));
    EXPECT_TRUE(has(World::ask(*client, R"({"component":"mine"})"), "open 'begin'"));
    EXPECT_TRUE(has(World::ask(*world.alive, R"({"set":{"a.in1":true}})"), "\"count\":1")) << "another connection is not concerned";
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
    EXPECT_TRUE(has(World::ask(client, R"({"component":"gone","pins":[{"name":"out","type":"float","dir":"out"},{"name":"new","type":"bit","dir":"in"},{"name":"new","type":"bit","dir":"in"}]})"),
                    "\"ok\":false"));
    EXPECT_EQ(world.state(), before);
}

}  // namespace
}  // namespace hal::test
