// SPDX-License-Identifier: MIT
#include "linuxcnc/launch.hpp"

#include <atomic>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fmt/format.h>
#include <poll.h>
#include <thread>
#include <unistd.h>

#include "base/poll_all.hpp"
#include "cli/output.hpp"
#include "commands/files.hpp"
#include "machine/processes/programs.hpp"
#include "run/fault_lines.hpp"
#include "run/report.hpp"
#include "run/run.hpp"
#include "text/diagnostic.hpp"

namespace hal::tools {

namespace {

using namespace std::chrono_literals;

Words with_ini(const Words& program, const std::string& ini) {
    Words words = program;
    words.insert(words.end(), {"-ini", ini});
    return words;
}

}  // namespace

Launch::Launch(const LinuxcncOptions& options, const Configuration& configuration,
               HostedMachine& machine, MachineLock& lock, RunJournal* journal)
    : options_(options),
      configuration_(configuration),
      machine_(machine),
      lock_(lock),
      journal_(journal),
      programs_(options, configuration, machine),
      monitor_(configuration, machine, programs_) {
    machine_.ini_path = configuration.file;
}

bool Launch::start_task_and_netlists() {
    const Configuration& c = configuration_;
    const auto component = [this](const char* key, const char* name, const Words& program,
                                  bool reads_ini = true) {
        return program.empty() || start_component(key, name, program, reads_ini);
    };
    const auto modules = [&] { return load_module(c.planner) && load_module(c.homing); };
    if (c.linuxcnc.version == LinuxcncVersion::v2_10) {
        return modules() && component("[TASK]TASK", "inihal", c.task) &&
               component("[HAL]HALUI", "halui", c.halui) &&
               component("[HAL]HALBRIDGE", "bridge", c.bridge, false) && load_netlists() &&
               start_threads() && task_knows_motion();
    }
    return component("[EMCIO]EMCIO", "iocontrol", c.io) &&
           component("[HAL]HALUI", "halui", c.halui) && modules() && load_netlists() &&
           start_task();
}

int Launch::run() {
    const bool started = check() && start_server() && start_task_and_netlists() &&
                         start_applications() && start_display();
    if (started) {
        const FaultLines faults(machine_.session);
        watch();
        end();
    } else {
        if (machine_.stop.requested()) {
            status_ = 0;
        }
        end();
    }
    if (const int signal = machine_.stop.signal(); signal != 0 && signal != SIGINT) {
        print(fmt::format("ended by SIG{}\n", ::sigabbrev_np(signal)));
    }
    return status_;
}

bool Launch::step(const std::string& sentence) {
    if (options_.verbose) {
        print(sentence + "\n");
    }
    return !machine_.stop.requested();
}

bool Launch::command(const Words& words, const std::string& source) {
    return machine_.shell.execute(words, output_, source) == 0 && !machine_.stop.requested();
}

bool Launch::check() {
    if (machine_.shell.read_ini(configuration_.given, output_) != 0) return false;
    Words checker{"linuxcnc_check_ini", configuration_.file};
    if (configuration_.linuxcnc.version == LinuxcncVersion::v2_9) {
        checker = {"tclsh", configuration_.linuxcnc.hallib + "/check_config.tcl",
                   configuration_.file};
    }
    if (find_program(configuration_, checker[0]).empty() ||
        (checker.size() > 2 && !std::filesystem::exists(checker[1]))) {
        return step("check the configuration: left out");
    }
    if (!step("check the configuration")) return false;
    const pid_t pid =
        programs_.start(std::filesystem::path(checker[checker.size() - 2]).filename(), checker);
    const auto status = pid == 0 ? std::optional(1) : programs_.wait_for(pid, -1);
    return status == 0;
}

bool Launch::start_server() {
    if (!step("start linuxcncsvr")) return false;
    const pid_t pid = programs_.start("linuxcncsvr", {"linuxcncsvr", "-ini", configuration_.file});
    if (pid == 0) return false;
    // it ends once its successor, adopted by this process, has the buffers ready
    const auto status = programs_.wait_for(pid, 10'000'000'000);
    if (machine_.stop.requested()) return false;
    if (status && *status != 0) {
        fail(options_,
             fmt::format("linuxcncsvr {}: another one may be using its TCP port or NML buffers",
                         end_description(*status)));

        return false;
    }
    const auto running = programs_.servers();
    if (running.empty()) {
        fail(options_, "linuxcncsvr has ended; the NML buffers need it");
        return false;
    }
    // now: this program may be killed at any time, and the next one ends the server
    lock_.note_server(running.front());
    return true;
}

bool Launch::start_component(const char* key, const char* component, const Words& program,
                             bool reads_ini) {
    if (!step(fmt::format("start {}", program[0]))) return false;
    Words words{"loadusr", "-Wn", component};
    for (const std::string& word : reads_ini ? with_ini(program, configuration_.file) : program) {
        words.push_back(word);
    }
    if (!command(words, fmt::format("{} {}", configuration_.given, key))) return false;
    monitor_.add(component, program[0]);
    return true;
}

bool Launch::load_module(const Words& module) {
    if (!step(fmt::format("load {}", module[0]))) return false;
    Words words{"loadrt"};
    words.insert(words.end(), module.begin(), module.end());
    return command(words, configuration_.given);
}

bool Launch::load_netlists() {
    if (!step("load the netlists of [HAL]HALFILE")) return false;
    const int status = machine_.shell.run_halfiles(configuration_.given, output_);
    if (status != 0 && !options_.keep_going) return false;
    // before task registers its pins meanwhile: in a re-execution no cycle needs these
    if (journal_ && journal_->begin_values(machine_) != 0) return false;
    return !machine_.stop.requested();
}

bool Launch::start_threads() {
    std::string commands;
    for (const std::string& line : configuration_.ini.all("HAL", "HALCMD")) {
        commands += line + "\n";
    }
    if (!commands.empty() &&
        machine_.shell.run_text(configuration_.given + " [HAL]HALCMD", commands, output_) != 0 &&
        !options_.keep_going) {
        return false;
    }
    if (!step("start the threads")) return false;
    machine_.start_threads();
    return !machine_.stop.requested();
}

// Displays read the limits of motion when they start.
bool Launch::task_knows_motion() {
    for (int waited_ms = 0; waited_ms < 10'000 && !machine_.stop.requested(); waited_ms += 10) {
        TextOutput text;
        if (machine_.shell.execute(Words{"getp", "ini.traj_max_velocity"}, text, "<linuxcnc>") !=
                0 ||
            std::strtod(text.out_text.c_str(), nullptr) != 0) {
            break;
        }
        machine_.stop.wait_ns(10'000'000);
    }
    return !machine_.stop.requested();
}

bool Launch::start_task() {
    // Task waits for motion's threads, which start only after it: so another thread waits for task.
    if (!step(fmt::format("start {}", configuration_.task[0]))) return false;
    Shell sibling(machine_.shell, machine_.shell.options);
    std::atomic<bool> waited{false};
    int task = 1;
    Words words{"loadusr", "-Wn", "inihal"};
    for (const std::string& word : with_ini(configuration_.task, configuration_.file)) {
        words.push_back(word);
    }
    std::thread waiting([&] {
        ProcessOutput output;
        task = sibling.execute(words, output, configuration_.given + " [TASK]TASK");
        waited = true;
    });
    const bool good = start_threads();
    while (!waited) {
        if (!good || machine_.stop.requested()) {
            sibling.cancel();
        }
        std::this_thread::sleep_for(5ms);
    }
    waiting.join();
    if (task == 0) {
        monitor_.add("inihal", configuration_.task[0]);
    }
    return good && task == 0 && !machine_.stop.requested();
}

bool Launch::start_applications() {
    if (configuration_.applications.empty()) return true;
    if (machine_.stop.wait_ns(configuration_.applications_delay_ns)) return false;
    for (const Words& words : configuration_.applications) {
        if (words.empty()) continue;
        if (!step(fmt::format("start {}", words[0]))) return false;
        const pid_t pid = programs_.start("[APPLICATIONS]APP", words);
        if (pid == 0) return false;
        applications_.push_back({words[0], pid});
    }
    return true;
}

bool Launch::start_display() {
    Words words = configuration_.display;
    display_.name = words[0];
    if (!step(fmt::format("start the display {}", words[0]))) return false;
    if (!configuration_.ini.all("HAL", "POSTGUI_HALFILE").empty() &&
        (words[0] == "linuxcncrsh" || words[0] == "dummy")) {
        write_all(STDERR_FILENO, fmt::format("{}: note: [HAL]POSTGUI_HALFILE is loaded by the "
                                             "display, and '{}' does not load it\n",
                                             options_.program, words[0]));
    }
    if (words[0] == "dummy") {
        print("press Enter to end the machine\n");
        return true;
    }
    const std::string program = find_program(configuration_, words[0]);
    const Words arguments(words.begin() + 1, words.end());
    words.resize(1);
    if (program.ends_with(".tcl") && words[0].find('/') == std::string::npos) {
        words[0] = program;
    }
    const bool server = words[0] == "linuxcncrsh";  // its own options come first
    if (server) {
        words.insert(words.end(), arguments.begin(), arguments.end());
        words.insert(words.end(), options_.arguments.begin(), options_.arguments.end());
        words.emplace_back("--");
    }
    words.insert(words.end(), {"-ini", configuration_.file});
    if (!server) {
        words.insert(words.end(), arguments.begin(), arguments.end());
        words.insert(words.end(), options_.arguments.begin(), options_.arguments.end());
    }
    display_.pid = programs_.start("[DISPLAY]DISPLAY", words, true);
    return display_.pid != 0;
}

bool Launch::display_ended() {
    const auto status = programs_.ended(display_.pid);
    if (!status) return false;
    // What ends all its programs, such as Ctrl-C in the terminal, is about to arrive here too.
    if (*status > 128 && machine_.stop.wait_ns(200'000'000)) {
        status_ = 0;
        return true;
    }
    status_ = *status;
    if (*status != 0) {
        fail(options_, fmt::format("the display '{}' {}", display_.name, end_description(*status)));
    }
    return true;
}

void Launch::report(const LaunchMonitor::Failure& failure) {
    status_ = 1;
    if (failure.task_works) {
        fail(options_, failure.sentence + "; the machine ends");
        return;
    }
    stop_threads();
    fail(options_, failure.sentence + "; the outputs have their safe values, the machine ends");
}

void Launch::watch() {
    LaunchMonitor::Failure found;
    std::chrono::steady_clock::time_point since{};
    for (unsigned looks = 1;; ++looks) {
        if (machine_.stop.requested()) break;
        if (display_.pid != 0) {
            if (display_ended()) return;
        } else if (line_typed()) {
            break;
        }
        const bool look_at_threads = looks % 5 == 0;
        if (look_at_threads) {
            monitor_.report_gaps();
        }
        if (found.sentence.empty()) {
            found = monitor_.failure(look_at_threads);
            since = std::chrono::steady_clock::now();
        } else if (std::chrono::steady_clock::now() - since > 200ms) {
            report(found);
            return;
        }
        machine_.stop.wait_ns(20'000'000);
    }
    status_ = 0;
}

bool Launch::line_typed() {
    pollfd input[] = {{STDIN_FILENO, POLLIN, 0}};
    const timespec at_once{};
    char c = 0;
    while (poll_all(input, &at_once) > 0) {
        if (::read(STDIN_FILENO, &c, 1) <= 0 || c == '\n') return true;
    }
    return false;
}

void Launch::stop_threads() {
    const auto lock = machine_.session.lock();
    Diagnostics diagnostics;
    if (!machine_.session.threads().stop(&diagnostics)) {
        write_all(STDERR_FILENO,
                  render(diagnostics, machine_.session.sources, colours(STDERR_FILENO)));
    }
}

/// Runs the netlist of [HAL]SHUTDOWN.
void Launch::run_shutdown() {
    if (configuration_.shutdown.empty()) return;
    step(fmt::format("run {}", configuration_.shutdown));
    std::string path, text, problem;
    if (!read_netlist(configuration_.shutdown, configuration_.folder, path, text, problem)) {
        fail(options_, fmt::format("[HAL]SHUTDOWN is '{}', which cannot be read: {}",
                                   configuration_.shutdown, problem));
        return;
    }
    machine_.shell.run_text(path, std::move(text), output_);
}

void Launch::end() {
    machine_.shell.cancel(false);
    if (!programs_.runs("inihal")) {
        stop_threads();  // nobody commands motion
    }
    if (display_.pid != 0) {
        step("end the display");
    }
    programs_.end_program(display_);
    for (LaunchPrograms::Program& application : applications_) {
        programs_.end_program(application);
    }
    // In the place of motmod, for tests: what task of 2.9 sends while it ends does not belong to
    // the log.
    if (configuration_.linuxcnc.version == LinuxcncVersion::v2_9) {
        programs_.end_component("motion-logger");
    }
    if (programs_.runs("inihal")) {
        step(fmt::format("end {}", configuration_.task[0]));
    }
    programs_.end_component("inihal");
    programs_.end_component("motion-logger");
    if (!programs_.servers().empty()) {
        step("end linuxcncsvr");
    }
    programs_.end_server();
    run_shutdown();
    step("stop the threads");
    stop_threads();
    step("unload everything");
    machine_.shell.execute(Words{"unload", "all"}, output_, "<linuxcnc>");
    programs_.wait_until_idle();
    if (journal_) {
        journal_->end_values();
    }
    const std::string failed_stops = machine_.end_report();
    if (!failed_stops.empty()) {
        write_all(STDERR_FILENO, failed_stops);
        status_ = std::max(status_, 1);
    }
    programs_.end_orphans();
}

}  // namespace hal::tools
