// SPDX-License-Identifier: MIT
#include "run/journal_test.hpp"

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fmt/core.h>
#include <map>
#include <sstream>
#include <vector>

#include "cli/output.hpp"
#include "journal/shortened_journal.hpp"
#include "netlist/netlist.hpp"
#include "run/chosen_values.hpp"
#include "run/journaled_program.hpp"
#include "run/replay_note.hpp"
#include "run/sim_summary.hpp"
#include "text/numbers.hpp"
#include "text/quoting.hpp"

namespace hal::tools {
namespace {

namespace fs = std::filesystem;

constexpr const char* journal_name = "journal.mcap";
constexpr const char* expected_name = "expected";
constexpr const char* netlist_name = "test.hal";

std::string value_of(Session& session, const std::string& name) {
    const auto reading = session.values().read({name}).front();
    return reading ? format_value(reading->type, reading->value) : "unknown";
}

/// The edits up to the end of the test, for people.
std::string netlist(const JournalFile& file, std::size_t entries) {
    std::string text =
        "# The machine of journal.mcap, with what was typed while it ran. Run the test with: hal "
        "replay FOLDER\n";
    for (std::size_t i = 0; i < std::min(entries, file.entries().size()); ++i) {
        if (file.entries()[i].kind != ExecutionEntry::Kind::edit) continue;
        for (const auto& words : file.entries()[i].commands) {
            if (words.empty() || words.front().starts_with(':')) continue;  // pins of a program
            std::string line;
            for (const std::string& word : words) {
                append_item(line, written(word), " ");
            }
            text += line + "\n";
        }
    }
    return text;
}

/// Executes the journal to its end. Returns why not, or "".
std::string execute(ReplayedMachine& machine) {
    machine.execution().accept_differences();
    while (machine.advance()) {
        if (machine.host().stop.requested()) return "interrupted";
    }
    const auto state = machine.execution().state();
    if (state == ReExecution::State::complete) return "";
    return "the execution ends early: " + machine.execution().reason();
}

}  // namespace

int write_journal_test(const ReplayOptions& options, const JournalFile& file,
                       ReplayedMachine& machine) {
    const fs::path folder = options.as_test;
    std::error_code error;
    fs::create_directories(folder, error);
    if (error) {
        return fail(options, fmt::format("cannot create the folder '{}': {}", options.as_test,
                                         error.message()));
    }
    const JournalProgress progress = machine.execution().progress();
    const auto cannot = [&](const char* name, const std::string& problem) {
        return fail(options,
                    fmt::format("cannot write '{}': {}", (folder / name).string(), problem));
    };
    std::string problem =
        write_shortened(options.words[0], (folder / journal_name).string(), progress);
    if (!problem.empty()) return cannot(journal_name, problem);
    const Model& model = machine.session().model();
    std::vector<std::string> names = named_values(model, names_in(options.show));
    if (names.empty()) {
        names = chosen_values(model, {});
    }
    std::string expected;
    for (const std::string& name : names) {
        expected += fmt::format("{} {}\n", name, value_of(machine.session(), name));
    }
    problem = write_file((folder / expected_name).string(), expected);
    if (!problem.empty()) return cannot(expected_name, problem);
    problem = write_file((folder / netlist_name).string(), netlist(file, progress.entries));
    if (!problem.empty()) return cannot(netlist_name, problem);
    print(fmt::format("{}: {}, {} expected; to run it, type: hal replay {}\n", options.as_test,
                      counted(machine.execution().cycles(), "cycle"),
                      counted(names.size(), "value"), options.as_test));
    return 0;
}

bool is_occupied(const std::string& path) {
    std::error_code error;
    const bool is_empty = fs::is_empty(path, error);
    return !error && !(is_empty && fs::is_directory(path, error));
}

bool is_journal_test(const std::string& path) {
    std::error_code ignored;
    return fs::exists(fs::path(path) / journal_name, ignored) &&
           fs::exists(fs::path(path) / expected_name, ignored);
}

int run_journal_test(const ReplayOptions& options) {
    const fs::path folder = options.words[0];
    std::string text;
    if (!read_file((folder / expected_name).string(), text)) return fail(options, text);
    ReplayOptions own = options;
    own.words = {(folder / journal_name).string()};
    JournalFile file;
    if (!file.open(own.words[0])) {
        return fail(options, fmt::format("cannot execute '{}': {}", own.words[0], file.problem()));
    }
    for (const std::string& remark : file.notes()) {
        note(options, remark);
    }
    // a test is run with other versions: it is there for that
    if (const int status = JournaledProgram(own, file).check_devices(); status != 0) return status;
    ReplayedMachine machine(own, file, ReplayedMachine::Compare::checksums);
    const auto lock = machine.session().lock();
    const std::string problem = execute(machine);
    std::string report;
    std::size_t values = 0;
    std::size_t wrong = 0;
    std::istringstream lines(text);
    for (std::string name, value; problem.empty() && lines >> name && std::getline(lines, value);) {
        ++values;
        value.erase(0, value.find_first_not_of(' '));
        const std::string now = value_of(machine.session(), name);
        if (now == value) continue;
        ++wrong;
        report += fmt::format("{} {} instead of {}\n", name, now, value);
    }
    if (const auto& diverged = machine.execution().diverged()) {
        report += fmt::format("first cycle that differs from the journal: {} of '{}' at {:.6f} s\n",
                              diverged->number, diverged->thread, seconds(diverged->time_ns));
    }
    if (!problem.empty()) {
        report += problem + "\n";
    } else if (values == 0) {
        report += fmt::format("'{}' has no line with a name and a value\n", expected_name);
    } else {
        report += fmt::format("{}: {}, {} not as expected\n",
                              counted(machine.execution().cycles(), "cycle"),
                              counted(values, "value"), wrong);
    }
    machine.execution().finish();
    if (!print(report)) return 1;
    return exit_code(problem.empty() && values > 0 && wrong == 0);
}

}  // namespace hal::tools
