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

struct ValueComparison {
    std::size_t values = 0;
    std::size_t wrong = 0;
    std::string differences;  ///< a line each
};

/// Compares the values of the machine with the lines NAME VALUE of the file.
ValueComparison compare_values(Session& session, const std::string& expected) {
    ValueComparison comparison;
    std::istringstream lines(expected);
    std::string name;
    std::string value;
    while (lines >> name && std::getline(lines, value)) {
        value.erase(0, value.find_first_not_of(' '));
        const std::string actual = value_of(session, name);
        ++comparison.values;
        if (actual != value) {
            ++comparison.wrong;
            comparison.differences += fmt::format("{} {} instead of {}\n", name, actual, value);
        }
    }
    return comparison;
}

std::string divergence_text(const ReExecution& execution) {
    const auto& diverged = execution.diverged();
    if (!diverged) return "";
    return fmt::format("first cycle that differs from the journal: {} of '{}' at {:.6f} s\n",
                       diverged->number, diverged->thread, seconds(diverged->time_ns));
}

std::string summary_of(const ValueComparison& comparison, std::uint64_t cycles) {
    if (comparison.values == 0) {
        return fmt::format("'{}' has no line with a name and a value\n", expected_name);
    }
    return fmt::format("{}: {}, {} not as expected\n", counted(cycles, "cycle"),
                       counted(comparison.values, "value"), comparison.wrong);
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
    // every user who may read the folder may run the test; a journal alone is for owner and group
    fs::permissions(folder / journal_name, fs::status(folder / expected_name).permissions(), error);
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
    std::string expected;
    if (!read_file((folder / expected_name).string(), expected)) {
        const std::string& reason = expected;
        return fail(options, reason);
    }
    const std::string journal = (folder / journal_name).string();
    JournalFile file;
    if (!file.open(journal)) {
        return fail(options, fmt::format("cannot execute '{}': {}", journal, file.problem()));
    }
    for (const std::string& remark : file.notes()) {
        note(options, remark);
    }
    ReplayOptions journal_options = options;
    journal_options.words = {journal};
    // the program and the plugins may be others than those of the journal: the test compares them
    const int status = JournaledProgram(journal_options, file).check_devices();
    if (status != 0) return status;
    ReplayedMachine machine(journal_options, file, ReplayedMachine::Compare::checksums);
    const auto lock = machine.session().lock();
    const std::string problem = execute(machine);
    std::string report;
    bool passed = false;
    if (problem.empty()) {
        const ValueComparison comparison = compare_values(machine.session(), expected);
        passed = comparison.values > 0 && comparison.wrong == 0;
        report = comparison.differences + divergence_text(machine.execution()) +
                 summary_of(comparison, machine.execution().cycles());
    } else {
        report = divergence_text(machine.execution()) + problem + "\n";
    }
    machine.execution().finish();
    if (!print(report)) return 1;
    return exit_code(passed);
}

}  // namespace hal::tools
