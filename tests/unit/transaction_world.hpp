// SPDX-License-Identifier: MIT
// The machine that the tests of transactions change.
#pragma once

#include "shell_machine.hpp"

#include <csignal>
#include <memory>
#include <string>

#include "control/connection.hpp"
#include "machine/processes/programs.hpp"

namespace hal::test {

/// A machine with a bit of everything: linked programs, one alive and one dead, aliases, values,
/// two threads, running.
struct World {
    static bool has(const std::string& text, const std::string& part) {
        return text.find(part) != std::string::npos;
    }

    World() {
        folder.write("good.hal", "newsig sourced bit\nsetp s.gain1 4\n");
        folder.write("bad.hal", "newsig sourced bit\nsetp nothere 1\n");
        machine.shell.options.directory = folder.path;
        machine.must(
            "loadrt and2 names=a,b\nloadrt not names=n,spare\nloadrt sum2 names=s\nnewthread fast "
            "1000000\nnewthread slow 4000000\n"
            "addf a fast\naddf n fast\naddf s slow\nnet link a.out => n.in\nnewsig free "
            "float\nsets free 2\nalias pin b.in0 second\n"
            "setp a.in0 1\nsetp s.gain0 2\nloadusr sleep 1000\nstart\nadvance 5 cycles\n");
        {
            const auto lock = machine.session.lock();
            child = machine.session.programs().find("sleep")->pid;
        }
        alive = std::make_unique<Connection>(machine.shell, child);
        EXPECT_TRUE(has(
            ask(*alive, R"({"component":"prog","pins":[{"name":"out","type":"bit","dir":"out"}]})"),
            "\"ok\":true"));
        {
            Connection dies(machine.shell, ::getpid());
            EXPECT_TRUE(has(
                ask(dies,
                    R"({"component":"gone","pins":[{"name":"out","type":"float","dir":"out","value":3,"safe":0}],"timeout_ms":-1})"),
                "\"ok\":true"));
        }
        machine.must(
            "net of-prog prog.out => b.in1\nnet of-gone gone.out => s.in0\nadvance 3 cycles\n");
    }

    static std::string ask(Connection& connection, const std::string& request) {
        std::string reply;
        connection.handle(request, reply, true);
        return reply;
    }
    static std::string run(Connection& connection, const std::string& line) {
        std::string quoted;
        for (const char c : line) {
            quoted += c == '"' ? "\\\"" : std::string(1, c);
        }
        return ask(connection, "{\"run\":\"" + quoted + "\"}");
    }

    std::string state() {
        std::string text;
        {
            auto lock = machine.session.lock();
            Programs& programs = machine.session.programs();
            const auto ending = [&] {
                for (const std::string& name : programs.names()) {
                    if (const auto* const entry = programs.find(name);
                        entry->stopping && entry->running()) {
                        return true;
                    }
                }
                return false;
            };
            while (ending()) {
                programs.wait(lock, std::chrono::milliseconds(20));
            }
            for (const std::string& name : programs.names()) {
                text += name + (programs.find(name)->dead() ? " dead\n" : " alive\n");
            }
            text += "locks " + std::to_string(machine.session.locked) +
                    (machine.session.threads().running() ? " running\n" : " stopped\n");
            EXPECT_FALSE(machine.session.in_transaction());
        }
        TextOutput output;
        Shell reader(machine.shell, {});
        for (const char* line : {"save allu", "list comp", "list pin", "list param", "list funct",
                                 "list thread", "save signalvalues"}) {
            reader.execute(line, output);
        }
        return text + output.out_text + output.err_text;
    }
    bool child_lives() const { return ::kill(child, 0) == 0; }

    Folder folder;
    ShellMachine machine;
    pid_t child = 0;
    std::unique_ptr<Connection> alive;  // before the machine
};

}  // namespace hal::test
