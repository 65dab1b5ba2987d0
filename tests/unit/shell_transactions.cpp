// SPDX-License-Identifier: MIT
// The property of all edits: whatever a text, or the lines between begin and commit, contain, a
// failure leaves the machine unchanged, or exactly as the lines that the message names make it.
// Model, values, programs, locks and threads are compared.
#include "transaction_world.hpp"

#include <csignal>
#include <memory>
#include <random>
#include <regex>
#include <sstream>
#include <vector>

#include <sys/wait.h>

#include "control/connection.hpp"
#include "machine/processes/programs.hpp"

namespace hal::test {
namespace {

bool has(const std::string& text, const std::string& part) {
    return text.find(part) != std::string::npos;
}

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

const std::vector<std::string> edits{"loadrt and2 names=x",
                                     "loadrt not count=2",
                                     "unloadrt b",
                                     "unload spare",
                                     "unload and2",
                                     "unload gone",
                                     "unload prog",
                                     "unload all",
                                     "unloadrt all",
                                     "reload not",
                                     "newthread third 8000000",
                                     "delthread slow",
                                     "addf spare slow",
                                     "addf spare fast 1",
                                     "addf --auto slow",
                                     "delf a fast",
                                     "initf b slow",
                                     "net new n.out => b.in0",
                                     "net link b.in0",
                                     "newsig another u32",
                                     "delsig link",
                                     "delsig all",
                                     "linkps s.out free",
                                     "linksp free s.in1",
                                     "linkpp n.out b.in0",
                                     "unlinkp n.in",
                                     "unlinkp prog.out",
                                     "unlinkp gone.out",
                                     "setp a.in0 0",
                                     "s.gain0 = 7",
                                     "setp s.offset -1",
                                     "sets free 9",
                                     "alias param s.gain0 factor",
                                     "alias pin prog.out pin-of-prog",
                                     "unalias pin second",
                                     "lock",
                                     "lock tune",
                                     "unlock",
                                     "unloadusr prog",
                                     "unloadusr gone",
                                     "unloadusr all",
                                     "fault clear",
                                     "source good.hal"};
const std::vector<std::string> looks{"show",
                                     "show comp",
                                     "show pin",
                                     "show thread",
                                     "show timing",
                                     "show latency",
                                     "show fault",
                                     "list sig",
                                     "status",
                                     "save",
                                     "save signalvalues",
                                     "getp a.in0",
                                     "gets free",
                                     "ptype a.in0",
                                     "stype free",
                                     "print hello",
                                     "help net",
                                     "explain two-writers",
                                     "echo",
                                     "unecho",
                                     "debug 1"};
const std::vector<std::string> acts{"start", "stop"};
const std::vector<std::string> outside{"advance 3 cycles", "loadusr -w true", "loadusr sleep 1000",
                                       "waitusr nobody", "save all saved.hal"};
const std::vector<std::string> failures{"setp nothere 1", "frobnicate", "loadrt nowhere"};
const std::vector<std::string> fillers{"newsig f1 bit", "setp s.gain1 3", "net f2 spare.out",
                                       "newthread f3 16000000"};

std::vector<std::string> with(const std::string& command, std::size_t position,
                              const std::string& failure) {
    std::vector<std::string> lines = fillers;
    lines.insert(lines.begin() + static_cast<std::ptrdiff_t>(position), command);
    if (!failure.empty()) {
        lines.push_back(failure);
    }
    return lines;
}

std::string joined(const std::vector<std::string>& lines) {
    std::string text;
    for (const std::string& line : lines) {
        text += line + "\n";
    }
    return text;
}

/// The numbers in front of "took effect" in the last line of what was printed.
std::vector<std::size_t> named_lines(const std::string& err) {
    std::vector<std::size_t> named;
    const auto end = err.rfind(" took effect");
    if (end == std::string::npos) return named;
    std::string row = err.substr(0, end);
    row = row.substr(
        std::min(row.rfind("; ") == std::string::npos ? 0 : row.rfind("; ") + 2, row.size()));
    static const std::regex run("([0-9]+)( to ([0-9]+))?");
    for (std::sregex_iterator at(row.begin(), row.end(), run), none; at != none; ++at) {
        const std::size_t first = std::stoul((*at)[1]);

        const std::size_t last = (*at)[3].matched ? std::stoul((*at)[3]) : first;
        for (std::size_t line = first; line <= last; ++line) {
            named.push_back(line);
        }
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
        const std::string err = world.machine.err;
        const std::string after = world.state();
        const bool lives = world.child_lives();
        if (after != worlds.before()) {
            worlds.changed();
        }
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
        ASSERT_EQ(other.machine.file(joined(effective)), 0)
            << joined(effective) << "of\n"
            << joined(lines) << err << other.machine.err;
        const std::string wanted = other.state();
        if (wanted != worlds.before()) {
            worlds.changed();
        }
        ASSERT_EQ(after, wanted) << joined(lines) << err;
    }

    void grouped(const std::vector<std::string>& lines, bool as_file) {
        World& world = worlds.fresh();
        ++combinations;
        std::string said;
        if (as_file) {
            ASSERT_EQ(world.machine.file("begin\n" + joined(lines) + "commit\n"), 1)
                << joined(lines);
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
        if (after != worlds.before()) {
            worlds.changed();
        }
        // by lines, what is rejected where it is typed leaves the transaction, which may then be a
        // good one
        if (!as_file && has(said, "\"status\":0")) return worlds.changed();
        ASSERT_EQ(after, worlds.before()) << joined(lines) << said;
        ASSERT_TRUE(lives) << joined(lines) << said;
    }
};

TEST_F(Property, a_file_that_fails_changes_nothing_or_what_its_message_names) {
    for (const auto* const kind : {&edits, &looks, &acts, &outside}) {
        for (const std::string& command : *kind) {
            for (std::size_t position = 0; position <= fillers.size(); ++position) {
                for (const std::string& failure : failures) {
                    file(with(command, position, failure));
                    if (HasFatalFailure()) return;
                }
            }
        }
    }
    RecordProperty("combinations", combinations);
    RecordProperty("worlds", worlds.made);
    EXPECT_GT(combinations, 1000);
}

TEST_F(Property, a_begin_that_fails_changes_nothing) {
    for (const auto* const kind : {&edits, &looks, &acts, &outside}) {
        for (const std::string& command : *kind) {
            for (std::size_t position = 0; position <= fillers.size(); ++position) {
                for (const std::string& failure : failures) {
                    for (const bool as_file : {true, false}) {
                        // they act at once
                        if (command == "save all saved.hal" || command == "debug 1" ||
                            command.starts_with("advance")) {
                            continue;
                        }
                        // rejected where it is typed
                        if (!as_file && failure == "frobnicate") continue;
                        grouped(with(command, position, failure), as_file);
                        if (HasFatalFailure()) return;
                    }
                }
            }
        }
    }
    RecordProperty("combinations", combinations);
    RecordProperty("worlds", worlds.made);
    EXPECT_GT(combinations, 1500);
}

TEST_F(Property, a_commit_does_what_its_lines_do_one_by_one) {
    for (const auto* const kind : {&edits, &acts}) {
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
}

// Two clients, line by line; each may be in a begin of its own, and one dies now and then.
TEST_F(Property, random_lines_of_two_clients_change_all_or_nothing) {
    std::mt19937 random(12);
    const auto one_of = [&](const std::vector<std::string>& all) {
        return all[random() % all.size()];
    };
    int refused = 0;
    int taken = 0;
    for (int sequence = 0; sequence < 60; ++sequence) {
        World& world = worlds.fresh();
        std::unique_ptr<Connection> clients[2];
        bool collecting[2] = {false, false};
        std::string before = world.state(), history;
        for (int step = 0; step < 25; ++step) {
            const std::size_t who = random() % 2;
            if (!clients[who]) {
                clients[who] = std::make_unique<Connection>(world.machine.shell, ::getpid());
            }
            const auto what = random() % 20;
            std::string line = what < 2    ? "begin"
                               : what < 4  ? "commit"
                               : what < 5  ? "abort"
                               : what < 7  ? one_of(failures)
                               : what < 8  ? "source bad.hal"
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
            const bool now = has(reply, "\"collecting\":true");
            const bool good = has(reply, "\"status\":0");
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

}  // namespace
}  // namespace hal::test
