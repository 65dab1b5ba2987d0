// SPDX-License-Identifier: MIT
// Which commands form a transaction, when it takes effect, and what the user reads about it.
#include "commands/help.hpp"
#include "commands/table.hpp"
#include "shell_machine.hpp"

namespace hal::test {
namespace {

bool has(const std::string& text, const std::string& part) {
    return text.find(part) != std::string::npos;
}

TEST(Script, a_file_with_an_error_changes_nothing_and_tells_all_errors) {
    ShellMachine machine;
    EXPECT_EQ(machine.file(
                  "loadrt and2 names=a\nnet s a.out => a.nothing\nfrobnicate\nsetp a.in0 maybe\n"),
              1);
    EXPECT_TRUE(has(machine.err, "test.hal:2:16: error: unknown pin 'a.nothing'")) << machine.err;
    EXPECT_TRUE(has(machine.err, "test.hal:3:1: error: unknown command 'frobnicate'"))
        << machine.err;
    EXPECT_TRUE(has(machine.err, "[bad-value]")) << machine.err;
    EXPECT_TRUE(machine.err.ends_with("\n3 errors; nothing was changed\n")) << machine.err;
    EXPECT_TRUE(machine.session.model().components.empty());
}

TEST(Script, a_command_that_acts_ends_the_transaction) {
    ShellMachine machine;
    EXPECT_EQ(machine.file("loadrt and2 names=a\ngetp a.in0\nsetp a.in0 1\ngetp a.in0\nnewthread t "
                           "1000000\nstart\nsetp a.in1 wrong\nloadrt not\n"),
              1);
    EXPECT_EQ(machine.out, "FALSE\nTRUE\n");
    EXPECT_TRUE(
        machine.err.ends_with("1 error; lines 1 to 6 took effect; lines 7 to 8 had no effect\n"))
        << machine.err;
    EXPECT_NE(machine.session.model().find_component("and2"), nullptr);
    EXPECT_EQ(machine.session.model().find_component("not"), nullptr);
}

TEST(Script, nothing_is_executed_after_a_failed_transaction) {
    ShellMachine machine;
    EXPECT_EQ(machine.file("setp nothing 1\nshow comp\nloadrt and2\n"), 1);
    EXPECT_EQ(machine.out, "");
    EXPECT_TRUE(machine.session.model().components.empty());
}

TEST(Script, a_syntax_error_belongs_to_the_transaction_of_its_line) {
    ShellMachine machine;
    EXPECT_EQ(
        machine.file("loadrt and2 names=a\nstart\nsetp a.in0 1\nsetp a.in1 \"1\nloadrt not\n"), 1);
    EXPECT_TRUE(machine.session.threads().running());
    EXPECT_TRUE(has(machine.err, "test.hal:4:")) << machine.err;
    EXPECT_EQ(machine.says("getp a.in0"), "FALSE\n");
}

TEST(Script, keep_going_makes_each_line_a_transaction_of_its_own) {
    ShellMachine machine({.keep_going = true});
    EXPECT_EQ(machine.file("loadrt and2 names=a\nsetp a.nothing 1\nsetp a.in0 1\nfrobnicate\nsetp "
                           "\"\nsetp a.in1 1\n"),
              1);
    EXPECT_EQ(machine.says("getp {a.in0,a.in1}"), "TRUE\nTRUE\n");
    machine.file("setp a.nothing 1\nfrobnicate\n");
    EXPECT_TRUE(machine.err.ends_with(
        "2 errors; lines with an error changed nothing, all others took effect\n"))
        << machine.err;
}

TEST(Script, keep_going_states_that_nothing_of_an_ignored_file_took_effect) {
    ShellMachine machine({.keep_going = true});
    const std::string binary = "newsig good bit\nsetp \x01 1\n";
    EXPECT_EQ(machine.file(binary), 1);
    EXPECT_TRUE(machine.err.ends_with("\n1 error; nothing was changed\n")) << machine.err;
    const std::string path =
        testing::TempDir() + "halcyon_binary" + std::to_string(getpid()) + ".hal";
    std::ofstream(path) << binary;
    EXPECT_EQ(machine.file("loadrt and2 names=a\nsource " + path + "\nsetp a.in0 1\n"), 1);
    std::remove(path.c_str());
    EXPECT_TRUE(machine.err.ends_with(
        "\n1 error; lines with an error and ignored files changed nothing, all others took "
        "effect\n"))
        << machine.err;
    EXPECT_EQ(machine.says("getp a.in0"), "TRUE\n");
}

TEST(Script, a_warning_does_not_stop_and_the_last_line_says_so) {
    ShellMachine machine;
    EXPECT_EQ(
        machine.file("loadrt and2 names=a\nnewthread t 1000000\nnet s a.out <= a.in0\naddf a t\n"),
        0)
        << machine.err;
    EXPECT_TRUE(has(machine.err, "[wrong-arrow]")) << machine.err;
    EXPECT_TRUE(machine.err.ends_with("; the edit took effect\n")) << machine.err;
}

TEST(Script, results_are_told_with_v_and_nothing_with_Q) {
    ShellMachine machine({.level = Level::results});
    EXPECT_EQ(machine.file("loadrt and2\nsetp and2.0.in0 1\n"), 0);
    EXPECT_EQ(machine.err, "2 edits took effect\n");
    machine.shell.options.level = Level::nothing;
    EXPECT_EQ(machine.file("frobnicate\n"), 1);
    EXPECT_EQ(machine.err, "");
    EXPECT_EQ(machine.line("debug 2"), 0);
    EXPECT_EQ(machine.shell.options.level, Level::results);
    EXPECT_EQ(machine.line("debug 7"), 1);
}

TEST(Script, an_assignment_is_a_setp) {
    ShellMachine machine;
    machine.must("loadrt and2 names=a\na.in0 = 1\n");
    EXPECT_EQ(machine.says("getp a.in0"), "TRUE\n");
    machine.line("lock");
    EXPECT_EQ(machine.line("a.in0 = 0"), 0) << "pins are free under a lock, as in LinuxCNC";
    EXPECT_EQ(machine.line("a.tmax = 0"), 1);
    EXPECT_TRUE(has(machine.err, "[locked]")) << machine.err;
}

TEST(Script, begin_collects_and_commit_applies) {
    ShellMachine machine;
    machine.must("loadrt and2 names=a\n");
    EXPECT_EQ(machine.line("begin"), 0);
    EXPECT_TRUE(machine.shell.collecting());
    EXPECT_EQ(machine.line("setp a.in0 1"), 0);
    EXPECT_EQ(machine.line("loadrt not names=n"), 0);
    EXPECT_EQ(machine.says("getp a.in0"), "FALSE\n");
    EXPECT_EQ(machine.line("net s a.out => n.in"), 0);
    EXPECT_EQ(machine.line("commit"), 0) << machine.err;
    EXPECT_FALSE(machine.shell.collecting());
    EXPECT_EQ(machine.says("getp a.in0"), "TRUE\n");
    EXPECT_EQ(machine.says("list sig"), "s \n");
}

TEST(Script, a_commit_with_an_error_changes_nothing) {
    ShellMachine machine;
    machine.must("loadrt and2 names=a\n");
    for (const char* line : {"begin", "setp a.in0 1", "setp a.nothing 1"}) {
        EXPECT_EQ(machine.line(line), 0) << line;
    }
    EXPECT_EQ(machine.line("commit"), 1);
    EXPECT_TRUE(machine.err.ends_with("1 error; nothing was changed\n")) << machine.err;
    EXPECT_TRUE(has(machine.err, "<shell>:1:6")) << machine.err;
    EXPECT_EQ(machine.says("getp a.in0"), "FALSE\n");
}

TEST(Script, abort_forgets) {
    ShellMachine machine;
    machine.must("loadrt and2 names=a\n");
    for (const char* line : {"begin", "setp a.in0 1", "abort"}) {
        EXPECT_EQ(machine.line(line), 0) << line;
    }
    EXPECT_EQ(machine.says("getp a.in0"), "FALSE\n");
    EXPECT_EQ(machine.line("commit"), 1);
    EXPECT_TRUE(has(machine.err, "[no-transaction]")) << machine.err;
    EXPECT_EQ(machine.line("begin"), 0);
    EXPECT_EQ(machine.line("begin"), 1);
    EXPECT_TRUE(has(machine.err, "[open-transaction]")) << machine.err;
}

TEST(Script, a_file_that_ends_before_its_commit_changes_nothing) {
    ShellMachine machine;
    EXPECT_EQ(machine.file("begin\nloadrt and2\n"), 1);
    EXPECT_TRUE(has(machine.err, "[open-transaction]")) << machine.err;
    EXPECT_TRUE(machine.session.model().components.empty());
    EXPECT_FALSE(machine.shell.collecting());
    EXPECT_EQ(machine.file("begin\nloadrt and2\ncommit\n"), 0) << machine.err;
    EXPECT_FALSE(machine.session.model().components.empty());
}

TEST(Script, shells_of_one_machine_do_not_share_a_begin) {
    ShellMachine machine;
    machine.must("loadrt and2 names=a\n");
    Shell other(machine.shell, {});
    TextOutput output;
    machine.line("begin");
    machine.line("setp a.in0 1");
    EXPECT_FALSE(other.collecting());
    EXPECT_EQ(other.execute("setp a.in1 1", output), 0) << output.err_text;
    EXPECT_EQ(other.execute("getp a.in0", output), 0);
    EXPECT_EQ(output.out_text, "FALSE\n");
}

TEST(Script, locks_forbid_and_say_how_to_unlock) {
    ShellMachine machine;
    machine.must(
        "loadrt and2 names=a\nloadrt sum2 names=s\nnet free a.in1\nnewthread t 1000000\nlock "
        "tune\n");
    for (const char* line : {"loadrt not", "net s a.out", "addf a t", "newthread u 2000000",
                             "loadusr -w true", "unload and2", "alias pin a.in0 x"}) {
        EXPECT_EQ(machine.line(line), 1) << line;
        EXPECT_TRUE(has(machine.err, "[locked]") && has(machine.err, "unlock tune")) << line << "\n"
                                                                                     << machine.err;
    }
    EXPECT_EQ(machine.line("setp a.in0 1"), 0) << machine.err;
    EXPECT_EQ(machine.line("start"), 0) << machine.err;
    machine.line("lock all");
    for (const char* line : {"setp s.gain0 0", "s.gain0 = 0", "setp s.gain[0..1] 0", "stop"}) {
        EXPECT_EQ(machine.line(line), 1) << line;
        EXPECT_TRUE(has(machine.err, "[locked]") && has(machine.err, "unlock all")) << machine.err;
    }
    EXPECT_EQ(machine.says("getp s.gain0"), "1\n");
    for (const char* line : {"setp a.in0 0", "a.in0 = 1", "setp s.in[0..1] 2", "sets free 1"}) {
        EXPECT_EQ(machine.line(line), 0) << line << machine.err;
    }
    EXPECT_EQ(machine.says("getp s.in1"), "2\n");
    EXPECT_EQ(machine.line("lock sideways"), 1);
    EXPECT_EQ(machine.line("unlock"), 0);
    EXPECT_EQ(machine.line("stop"), 0) << machine.err;
}

TEST(Script, echo_and_print_go_to_stderr_with_their_place) {
    ShellMachine machine;
    EXPECT_EQ(machine.file("echo\n\nprint hello \"a b\"\nunecho\nprint\n"), 0);
    EXPECT_EQ(machine.out, "Echo on\nEcho off\n");
    EXPECT_EQ(machine.err,
              "(3)<echo>: print hello \"a b\"\ntest.hal:3: HALCMD MSG: hello \"a b\"\n(4)<echo>: "
              "unecho\ntest.hal:5: HALCMD MSG:\n");
}

TEST(Script, quit_stops_reading) {
    ShellMachine machine;
    EXPECT_EQ(machine.file("loadrt and2\nquit\nloadrt not\n"), 0) << machine.err;
    EXPECT_EQ(machine.says("list comp"), "and2 \n");
    EXPECT_FALSE(machine.shell.quit());
    EXPECT_EQ(machine.line("exit"), 0);
    EXPECT_TRUE(machine.shell.quit());
}

TEST(Script, every_row_of_the_table_is_found_by_its_name_and_has_a_summary) {
    for (const CommandRow& row : command_table()) {
        EXPECT_EQ(find_command(row.name), &row);
        EXPECT_TRUE(*row.summary) << row.name;
        EXPECT_NE(row.function.act == nullptr, row.function.edit == nullptr) << row.name;
    }
}

// The usage text of a row is the only one: messages, help, the manual and completion show it or
// follow from it.
TEST(Script,
     the_usage_of_every_row_is_the_one_in_its_error_its_help_the_manual_and_its_completion) {
    ShellMachine machine;
    const std::string manual = command_manual();
    for (const CommandRow& row : command_table()) {
        const std::string usage = to_string(row.usage());
        const std::string name = row.name;
        EXPECT_TRUE(has(machine.says("help " + name), usage + "\n  " + row.summary))
            << name << machine.out;
        EXPECT_TRUE(has(manual, "\n    " + usage + "\n")) << name;
        const auto forms = usage_forms(row.arguments);
        const auto& words = forms.front();
        const auto min = static_cast<std::size_t>(std::count_if(
            words.begin(), words.end(), [](const UsageWord& word) { return !word.optional; }));
        const bool open = std::any_of(words.begin(), words.end(),
                                      [](const UsageWord& word) { return word.repeats; });
        std::vector<std::string> lines;
        if (min > 0) {
            lines.push_back(name);
        }
        if (!open) {
            lines.push_back(name);
            for (std::size_t i = 0; i <= words.size(); ++i) {
                lines.back() += " x";
            }
        }
        for (const std::string& line : lines) {
            EXPECT_EQ(machine.line(line), 1) << line;
            EXPECT_TRUE(has(machine.err, name + " takes ") &&
                        has(machine.err, "[wrong-arguments]") &&
                        has(machine.err, "= help: " + usage + "\n"))
                << line << "\n"
                << machine.err;
        }
        // a choice of words or an option in the usage is what completion offers there
        for (const auto& form : forms) {
            const std::string_view first =
                form.empty() ? "" : form.front().text.substr(0, form.front().text.find('|'));
            if (first.empty() || first.find_first_of("ABCDEFGHIJKLMNOPQRSTUVWXYZ=") != first.npos) {
                continue;
            }
            const auto candidates = machine.shell.complete(name + " ", name.size() + 1).candidates;
            EXPECT_TRUE(std::any_of(candidates.begin(), candidates.end(),
                                    [&](const Candidate& one) {
                return one.text == first;
            })) << name
                << " " << first;
        }
    }
}

TEST(Script, a_second_form_of_a_command_is_counted_by_itself) {
    ShellMachine machine;
    EXPECT_EQ(machine.line("addf --auto"), 1);
    EXPECT_TRUE(has(machine.err, "addf takes at least 2 arguments, not 1")) << machine.err;
    EXPECT_EQ(machine.line("addf f t 1 2"), 1);
    EXPECT_TRUE(has(machine.err, "addf takes at most 3 arguments, not 4")) << machine.err;
    machine.must("loadrt and2 names=a,b,c,d\nnewthread t 1000000\n");
    EXPECT_EQ(machine.line("addf --auto t a b c d"), 0) << machine.err;
}

TEST(Script, help_knows_every_command) {
    ShellMachine machine;
    const std::string all = machine.says("help");
    for (const char* command :
         {"loadrt", "net", "setp", "addf", "save", "quit, exit", "newthread", "advance"}) {
        EXPECT_TRUE(has(all, command)) << command;
    }
    EXPECT_TRUE(machine.says("help net").starts_with("net SIGNAL PIN...\n")) << machine.out;
    EXPECT_EQ(machine.line("help nett"), 1);
    EXPECT_TRUE(has(machine.err, "did you mean 'net'")) << machine.err;
    EXPECT_TRUE(has(machine.says("explain two-writers"), "one writer")) << machine.out;
    EXPECT_EQ(machine.line("explain two-writer"), 1);
    EXPECT_TRUE(has(command_manual(), "\n## net\n\n    net SIGNAL PIN...\n")) << command_manual();
}

TEST(Script, arguments_are_counted_and_the_usage_shown) {
    ShellMachine machine;
    EXPECT_EQ(machine.line("getp"), 1);
    EXPECT_TRUE(has(machine.err, "getp takes 1 argument, not 0 [wrong-arguments]") &&
                has(machine.err, "help: getp PIN-OR-PARAMETER"))
        << machine.err;
    EXPECT_EQ(machine.line("start now"), 1);
    EXPECT_TRUE(has(machine.err, "start takes 0 arguments, not 1")) << machine.err;
    EXPECT_EQ(machine.line("setexact_for_test_suite_only"), 0);
}

TEST(Script, advance_takes_cycles_or_a_time) {
    ShellMachine machine;
    EXPECT_EQ(machine.line("advance 5 cycles"), 1);
    EXPECT_TRUE(has(machine.err, "[no-thread]")) << machine.err;
    machine.must("newthread t 1000000\n");
    const auto beats = [&] { return std::stoi(machine.says("getp t.threadbeat")); };
    const int before = beats();
    EXPECT_EQ(machine.line("advance 5 cycles"), 0) << machine.err;
    EXPECT_EQ(beats(), before + 5);
    EXPECT_EQ(machine.line("advance 250ms"), 0) << machine.err;
    EXPECT_EQ(beats(), before + 255);
    for (const char* line :
         {"advance 5", "advance soon", "advance 5 bananas", "advance -1 cycles"}) {
        EXPECT_EQ(machine.line(line), 1) << line;
        EXPECT_TRUE(has(machine.err, "[bad-duration]")) << machine.err;
    }
}

TEST(Script, a_check_looks_at_the_whole_file_and_does_nothing) {
    ShellMachine machine({.check = true}, shell_session("test", true, true));
    EXPECT_EQ(
        machine.file("loadrt and2 names=a\nstart\nloadusr -w touch /should-not-be-there\nshow "
                     "pin\nsetp a.in0 x\nnewthread t 1000000\nsetp a.in1 y\n"),
        1);
    EXPECT_EQ(machine.out, "");
    EXPECT_TRUE(machine.err.ends_with("\n2 errors\n")) << machine.err;
    EXPECT_FALSE(machine.session.threads().running());
}

TEST(Script, lines_that_make_nothing_leave_no_text_behind) {
    ShellMachine machine;
    machine.must(
        "loadrt and2 names=a\nnewthread t 1000000\nnet s a.out\nadvance 1 cycles\n");  // the first advance is kept, for a warning
    const auto next_number = [&] {
        const auto number = machine.session.sources.add("probe", "x");
        machine.session.sources.drop(number);
        return number;
    };
    const auto before = next_number();
    for (const char* line : {"getp a.in0", "setp a.in0 1", "show pin", "frobnicate", "a.in0 = 0",
                             "setp nothing 1", "advance 1 cycles", "help", "unlinkp a.out"}) {
        machine.line(line);
    }
    EXPECT_EQ(next_number(), before);
    machine.line("net s a.out");
    EXPECT_EQ(next_number(), before + 1);
}

// --- files -----------------------------------------------------------------------------------------------------------------

struct Files : testing::Test {
    Files() { machine.shell.options.directory = folder.path; }
    Folder folder;
    ShellMachine machine;
};

TEST_F(Files, source_runs_a_file_in_its_place) {
    folder.write("inner.hal", "loadrt not \\\n names=n\nprint inside\n");
    EXPECT_EQ(machine.file("loadrt and2 names=a\nsource inner.hal\nnet s a.out => n.in\n"), 0)
        << machine.err;
    EXPECT_TRUE(has(machine.err, "/inner.hal:3: HALCMD MSG: inside\n")) << machine.err;
    EXPECT_EQ(machine.says("list sig"), "s \n");
}

TEST_F(Files, an_error_in_a_sourced_file_undoes_the_whole_transaction) {
    folder.write("inner.hal", "loadrt not names=n\nsetp n.nothing 1\n");
    EXPECT_EQ(machine.file("loadrt and2 names=a\nsource inner.hal\n"), 1);
    EXPECT_TRUE(has(machine.err, "/inner.hal:2:6: error:")) << machine.err;
    EXPECT_TRUE(machine.session.model().components.empty());
}

TEST_F(Files, a_file_that_reads_itself_is_refused_with_the_way_round) {
    folder.write("a.hal", "source b.hal\n");
    folder.write("b.hal", "# b\nsource ./a.hal\n");
    EXPECT_EQ(machine.path("a.hal"), 1);
    EXPECT_TRUE(has(machine.err, "b.hal:2:8: error: './a.hal' includes itself [recursive-source]"))
        << machine.err;
    EXPECT_TRUE(has(machine.err, "included from here")) << machine.err;
}

TEST_F(Files, a_file_beside_the_one_that_names_it_is_found) {
    std::filesystem::create_directory(folder.path + "/sub");
    folder.write("sub/outer.hal", "source inner.hal\n");
    folder.write("sub/inner.hal", "loadrt not\n");
    EXPECT_EQ(machine.path("sub/outer.hal"), 0) << machine.err;
}

TEST_F(Files, a_quit_in_a_sourced_file_ends_that_file) {
    folder.write("inner.hal", "loadrt not\nquit\nloadrt or2\n");
    EXPECT_EQ(machine.file("source inner.hal\nloadrt and2\n"), 0) << machine.err;
    EXPECT_EQ(machine.says("list comp"), "and2 not \n");
}

TEST_F(Files, what_cannot_be_read_says_why) {
    EXPECT_EQ(machine.path("nothing.hal"), 1);
    EXPECT_TRUE(has(machine.err,
                    "'nothing.hal' cannot be read: No such file or directory [unreadable-file]"))
        << machine.err;
    EXPECT_EQ(machine.line("source ."), 1);
    EXPECT_TRUE(has(machine.err, "directory")) << machine.err;
    EXPECT_EQ(machine.path("x.tcl"), 1);
    EXPECT_TRUE(has(machine.err, "[unsupported-file]")) << machine.err;
}

TEST_F(Files, an_ini_file_names_its_halfiles_and_commands) {
    folder.write("one.hal", "loadrt and2 names=a\nsetp a.in0 [AXIS]ON\n");
    folder.write("two.hal", "loadrt not names=n\nnet s a.out => n.in\n");
    folder.write("m.ini",
                 "[HAL]\nHALFILE = one.hal\nHALFILE = two.hal\nHALCMD = setp a.in1 1\nHALCMD = "
                 "print [AXIS]ON\n[AXIS]\nON = TRUE\n");
    machine.shell.options.directory.clear();
    EXPECT_EQ(machine.path(folder.path + "/m.ini"), 0) << machine.err;
    EXPECT_EQ(machine.says("getp {a.in0,a.in1}"), "TRUE\nTRUE\n");
    EXPECT_EQ(machine.shell.options.directory, "");
    EXPECT_EQ(machine.line("setp a.in0 [AXIS]ON"), 0) << machine.err;
}

TEST_F(Files, an_ini_file_with_something_missing_runs_nothing) {
    folder.write("one.hal", "loadrt and2 names=a\n");
    folder.write("m.ini", "[HAL]\nHALFILE = one.hal\nHALFILE = missing.hal\nHALFILE = loop.tcl\n");
    EXPECT_EQ(machine.path("m.ini"), 1);
    EXPECT_TRUE(has(machine.err, "missing.hal") && has(machine.err, "loop.tcl")) << machine.err;
    EXPECT_TRUE(machine.session.model().components.empty());
}

TEST_F(Files, two_passes_load_everything_first) {
    folder.write("one.hal",
                 "loadrt and2 names=a\nnet s a.out => c.in0\nloadrt not count=1\nnet t not.0.out "
                 "=> not.1.in\nnewthread th 1000000\naddf c th\naddf a th\n");
    folder.write("two.hal", "source three.hal\nloadrt not count=1\n");
    folder.write("three.hal", "loadrt and2 names=b,c\n");
    folder.write("m.ini", "[HAL]\nTWOPASS = on\nHALFILE = one.hal\nHALFILE = two.hal\n");
    EXPECT_EQ(machine.path("m.ini"), 0) << machine.err;
    EXPECT_EQ(machine.says("list funct"), "a b c not.0 not.1 \n");
    machine.shell.options.script = true;
    EXPECT_TRUE(machine.says("show thread").ends_with(" c a\n\n")) << machine.out;
}

TEST_F(Files, a_file_may_opt_out_of_two_passes) {
    folder.write("one.hal", "loadrt and2 names=a\nnet s c.in0\n");
    folder.write("two.hal", "# notwopass\nloadrt and2 names=c\nfrobnicate\nsetp c.in1 1\n");
    folder.write("three.hal", "net s2 c.in1\n");
    folder.write(
        "m.ini",
        "[HAL]\nTWOPASS = on\nHALFILE = two.hal\nHALFILE = one.hal\nHALFILE = three.hal\n");
    EXPECT_EQ(machine.path("m.ini"), 1);
    EXPECT_TRUE(has(machine.err, "frobnicate")) << machine.err;
    EXPECT_EQ(machine.says("list sig"), "s s2 \n");
    EXPECT_EQ(machine.says("getp c.in1"), "TRUE\n");
}

}  // namespace
}  // namespace hal::test
