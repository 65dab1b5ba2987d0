// SPDX-License-Identifier: MIT
// loadusr and its like: programs outside the runtime.
#include <csignal>
#include <thread>

#include "control/connection.hpp"
#include "machine.hpp"
#include "machine/processes/programs.hpp"
#include "shell_machine.hpp"

namespace hal::test {
namespace {

bool has(const std::string& text, const std::string& part) {
    return text.find(part) != std::string::npos;
}

/// With the session's lock: what is known of a program.
bool running(ShellMachine& machine, const std::string& name) {
    const auto lock = machine.session.lock();
    return machine.session.programs().find(name) != nullptr;
}

TEST(Process, waited_for_its_output_and_status_come_back) {
    ShellMachine machine;
    EXPECT_EQ(machine.line("loadusr -w echo hello"), 0) << machine.err;
    EXPECT_EQ(machine.out, "hello\n");
    EXPECT_EQ(machine.line("loadusr -w false"), 1);
    EXPECT_TRUE(has(machine.err, "'false' failed with exit status 1 [program-failed]"))
        << machine.err;
    EXPECT_EQ(machine.line("loadusr -i -w false"), 0) << machine.err;
    const Folder folder;
    const std::string script =
        folder.write("both", "#!/bin/sh\necho out\necho err >&2\nkill -TERM $$\n");
    std::filesystem::permissions(script, std::filesystem::perms::owner_all);
    EXPECT_EQ(machine.line("loadusr -w " + script), 1);
    EXPECT_EQ(machine.out, "out\n");
    EXPECT_TRUE(has(machine.err, "err\n") && has(machine.err, "was terminated by signal 15"))
        << machine.err;
    EXPECT_EQ(machine.says("list comp"), "\n");
}

TEST(Process, much_output_is_cut_and_the_program_still_ends) {
    ShellMachine machine;
    EXPECT_EQ(machine.line("loadusr -w head -c 3000000 /dev/zero"), 0)
        << machine.err.substr(0, 200);
    EXPECT_GT(machine.out.size(), 1'000'000U);
    EXPECT_LT(machine.out.size(), 1'200'000U);
    EXPECT_TRUE(has(machine.err, "output truncated after 1 MiB")) << machine.err;
}

TEST(Process, one_that_cannot_be_started_says_why) {
    ShellMachine machine;
    EXPECT_EQ(machine.line("loadusr no-such-program-at-all"), 1);
    EXPECT_TRUE(has(machine.err, "No such file or directory [no-program]")) << machine.err;
    EXPECT_EQ(machine.line("loadusr -x sleep 1"), 1);
    EXPECT_TRUE(has(machine.err, "[unknown-option]")) << machine.err;
    EXPECT_EQ(machine.line("loadusr -w"), 1);
    EXPECT_TRUE(has(machine.err, "[wrong-arguments]")) << machine.err;
    EXPECT_EQ(machine.line("loadusr -Wn"), 1);
}

TEST(Process, it_runs_in_the_shells_folder_and_knows_its_instance) {
    const Folder folder;
    ShellMachine machine({.directory = folder.path});
    EXPECT_EQ(machine.line("loadusr -w pwd"), 0) << machine.err;
    EXPECT_EQ(machine.out, std::filesystem::canonical(folder.path).string() + "\n");
    EXPECT_EQ(machine.line("loadusr -w printenv HALCYON_INSTANCE"), 0) << machine.err;
    EXPECT_EQ(machine.out, "test\n");
}

TEST(Process, in_the_background_it_is_a_component_until_it_ends) {
    ShellMachine machine;
    machine.must("loadrt and2\nloadusr sleep 1000\nloadusr sleep 1000\n");
    EXPECT_EQ(machine.says("list comp"), "sleep-2 sleep and2 \n");
    EXPECT_TRUE(has(machine.says("show comp sleep-2"), " User  sleep-2 ")) << machine.out;
    EXPECT_TRUE(has(machine.out, " initializing\n")) << machine.out;
    EXPECT_EQ(machine.line("unloadusr sleep"), 0) << machine.err;
    EXPECT_EQ(machine.line("waitusr sleep"), 0) << machine.err;
    EXPECT_EQ(machine.says("list comp"), "sleep-2 and2 \n");
    EXPECT_EQ(machine.line("unload sleep-2"), 0) << machine.err;
    EXPECT_TRUE(eventually([&] { return !running(machine, "sleep-2"); }));
    EXPECT_EQ(machine.line("waitusr sleep-2"), 0) << machine.err;
    EXPECT_EQ(machine.says("list comp"), "and2 \n");
}

TEST(Process, unload_all_ends_programs_and_components) {
    ShellMachine machine;
    machine.must("loadrt and2\nloadusr sleep 1000\nunload all\n");
    EXPECT_EQ(machine.line("waitusr sleep"), 0);
    EXPECT_EQ(machine.says("list comp"), "\n");
    EXPECT_EQ(machine.line("unloadusr all"), 0);
    EXPECT_EQ(machine.line("unloadusr sleep"), 1);
    EXPECT_TRUE(has(machine.err, "[not-a-program]")) << machine.err;
    machine.must("loadrt and2\n");
    EXPECT_EQ(machine.line("waitusr and2"), 1);
}

TEST(Process, W_waits_until_the_program_says_it_is_ready) {
    ShellMachine machine;
    std::thread announcer([&] {
        ASSERT_TRUE(eventually([&] { return running(machine, "panel"); }));
        const auto lock = machine.session.lock();
        const auto pid = machine.session.programs().find("panel")->pid;
        EXPECT_EQ(machine.session.programs().announce(pid, "panel"), "");
    });
    EXPECT_EQ(machine.line("loadusr -Wn panel sleep 1000"), 0) << machine.err;
    announcer.join();
    EXPECT_TRUE(has(machine.says("show comp panel"), " ready\n")) << machine.out;
}

TEST(Process, W_gives_up_when_the_program_ends_first) {
    ShellMachine machine;
    EXPECT_EQ(machine.line("loadusr -W true"), 1);
    EXPECT_TRUE(
        has(machine.err, "'true' ended before a component 'true' was ready [program-ended]"))
        << machine.err;
    EXPECT_EQ(machine.says("list comp"), "\n");
}

TEST(Process, a_reserved_name_is_not_for_a_program_from_before) {
    ShellMachine machine;
    machine.must("loadusr sleep 1000\n");
    std::thread announcer([&] {
        ASSERT_TRUE(eventually([&] { return running(machine, "panel"); }));
        usleep(30'000);
        const auto lock = machine.session.lock();
        Programs& programs = machine.session.programs();
        const auto older = programs.find("sleep")->pid;
        const auto newer = programs.find("panel")->pid;
        EXPECT_NE(programs.announce(older, "panel")
                      .find("is reserved for process " + std::to_string(newer)),
                  std::string::npos);
        EXPECT_EQ(programs.announce(newer, "second", 1), "")
            << "a component of another name does not give the first away";
        EXPECT_NE(programs.find("panel"), nullptr);
        EXPECT_EQ(programs.announce(newer, "panel", 2), "");
    });
    usleep(50'000);
    EXPECT_EQ(machine.line("loadusr -Wn panel sleep 1000"), 0) << machine.err;
    announcer.join();
    EXPECT_EQ(machine.says("list comp"), "second panel sleep \n");
}

TEST(Process, a_program_may_choose_another_name_but_no_taken_one) {
    ShellMachine machine;
    machine.must("loadrt and2\nloadusr sleep 1000\n");
    {
        const auto lock = machine.session.lock();
        Programs& programs = machine.session.programs();
        const auto pid = programs.find("sleep")->pid;
        EXPECT_NE(programs.announce(pid, "and2"), "");
        EXPECT_NE(programs.announce(pid, "bad name"), "");
        EXPECT_EQ(programs.announce(pid, "panel"), "");
        EXPECT_NE(programs.announce(pid, "second"), "");
        EXPECT_NE(programs.announce(getpid(), "panel"), "");
    }
    EXPECT_EQ(machine.says("list comp"), "panel and2 \n");
}

TEST(Process, a_waiting_command_can_be_cancelled_and_others_go_on_meanwhile) {
    ShellMachine machine;
    machine.must("loadrt and2 names=a\n");
    Shell other(machine.shell, {});
    std::thread waiter([&] {
        EXPECT_EQ(machine.line("loadusr -w sleep 1000"), 1);
        EXPECT_TRUE(has(machine.err, "[interrupted]")) << machine.err;
    });
    TextOutput output;
    EXPECT_TRUE(eventually([&] {
        const auto lock = machine.session.lock();
        return !machine.session.programs().idle();
    }));
    EXPECT_EQ(other.execute("setp a.in0 1", output), 0) << output.err_text;
    machine.shell.cancel();
    waiter.join();
}

TEST(Process, those_still_running_are_ended_with_the_shells) {
    pid_t pid = 0;
    {
        ShellMachine machine;
        machine.must("loadusr sleep 1000\n");
        pid = machine.session.programs().find("sleep")->pid;
        EXPECT_EQ(kill(pid, 0), 0);
    }
    EXPECT_EQ(kill(pid, 0), -1);
}

TEST(Process, the_real_clock_is_waited_for_without_the_mutex) {
    ShellMachine machine({}, shell_session("test", false));
    machine.must("newthread t 1000000\n");
    EXPECT_EQ(machine.line("advance 20 cycles"), 0) << machine.err;
    EXPECT_GE(std::stoi(machine.says("getp t.threadbeat")), 20);
    EXPECT_EQ(machine.line("advance 5ms"), 0) << machine.err;
    std::thread waiter([&] { EXPECT_EQ(machine.line("advance 1h"), 1); });
    machine.shell.cancel();
    waiter.join();
    EXPECT_TRUE(has(machine.err, "[interrupted]")) << machine.err;
}

/// A child and a connection by which it registers a component with a pin.
struct Child {
    explicit Child(ShellMachine& of, bool waited = false) : machine(of) {
        std::string problem;
        const auto lock = machine.session.lock();
        pid = machine.session.programs().start({.arguments = {"sleep", "1000"}, .directory = {}},
                                               waited, problem);
        EXPECT_NE(pid, 0) << problem;
    }
    void declare(const std::string& name, bool ready = true) {
        connection = std::make_unique<Connection>(machine.shell, pid);
        const std::string text = R"({"component":")" + name + R"(","ready":)" +
                                 (ready ? "true" : "false") +
                                 R"(,"pins":[{"name":"out","type":"bit","dir":"out"}]})";
        std::string reply;
        EXPECT_EQ(connection->handle(text, reply), Connection::Handled::done);
        EXPECT_TRUE(has(reply, R"("ok":true)")) << reply;
    }
    void end() const {
        kill(pid, SIGKILL);
        EXPECT_TRUE(eventually([&] {
            const auto lock = machine.session.lock();
            const auto* const entry = machine.session.programs().find(pid);
            return !entry || entry->ended();
        }));
    }

    ShellMachine& machine;
    pid_t pid = 0;
    std::unique_ptr<Connection> connection;
};

TEST(Process, that_lost_its_component_registers_another_one) {
    ShellMachine machine;
    Child child(machine);
    child.declare("first");
    child.connection.reset();
    EXPECT_TRUE(has(machine.says("show comp first"), " dead since ")) << machine.out;
    child.declare("second");
    EXPECT_TRUE(has(machine.says("show comp second"), " ready\n")) << machine.out;
    EXPECT_EQ(machine.says("list comp"), "second \n");
}

TEST(Process, status_is_kept_for_the_command_that_waits_after_its_component_is_lost) {
    ShellMachine machine;
    Child child(machine, true);
    child.declare("lost");
    child.connection.reset();
    child.end();
    const auto lock = machine.session.lock();
    Programs& programs = machine.session.programs();
    ASSERT_NE(programs.find(child.pid), nullptr);
    EXPECT_EQ(programs.find(child.pid)->status, 128 + SIGKILL);
    programs.collect(child.pid);
    EXPECT_EQ(programs.find(child.pid), nullptr);
    EXPECT_TRUE(programs.find("lost")->dead());
}

TEST(Process, whose_start_failed_takes_no_other_program_with_it) {
    ShellMachine machine;
    Child failed(machine);
    failed.declare("failed", false);
    Child other(machine);
    other.declare("other");
    failed.end();
    {
        const auto lock = machine.session.lock();
        Programs& programs = machine.session.programs();
        ASSERT_TRUE(programs.find("failed")->dead());
        programs.give_up(*programs.find("failed"));
    }
    EXPECT_EQ(machine.says("list comp"), "other \n");
    EXPECT_TRUE(has(machine.says("show comp other"), " ready\n")) << machine.out;
}

}  // namespace
}  // namespace hal::test
