// SPDX-License-Identifier: MIT
#include "run/exact_replay.hpp"

#include <algorithm>
#include <bit>
#include <charconv>
#include <chrono>
#include <cstdlib>
#include <fmt/core.h>
#include <memory>
#include <optional>
#include <set>
#include <string_view>
#include <unistd.h>

#include "cli/output.hpp"
#include "commands/table.hpp"
#include "journal/file_hash.hpp"
#include "journal/journal_file.hpp"
#include "journal/re_execution.hpp"
#include "paths.hpp"
#include "run/hosted_machine.hpp"
#include "run/sim_summary.hpp"
#include "run/value_check.hpp"
#include "text/numbers.hpp"
#include "text/quoting.hpp"

namespace hal::tools {
namespace {

void note(const ReplayOptions& options, const std::string& text) {
    write_all(STDERR_FILENO, fmt::format("{}: {}\n", options.program, text));
}

double seconds(std::int64_t ns) { return static_cast<double>(ns) * 1e-9; }

double real_of(hal_type type, hal_value value) {
    switch (type) {
    case HAL_TYPE_BIT: return value.bit ? 1.0 : 0.0;
    case HAL_TYPE_S32: return value.s32;
    case HAL_TYPE_U32: return value.u32;
    case HAL_TYPE_S64: return static_cast<double>(value.s64);
    case HAL_TYPE_U64: return static_cast<double>(value.u64);
    default: return value.real;
    }
}

/// --until and --break: where the execution stops before the end of the journal.
class StopRule {
public:
    /// Returns why an option is invalid; "" when both are good.
    std::string parse(const ReplayOptions& options) {
        if (!options.until.empty() && !parse_until(options.until)) {
            return fmt::format("--until: invalid cycle or time '{}'; write 12000, 3.5s or 250ms",
                               options.until);
        }
        if (!options.break_condition.empty() && !parse_break(options.break_condition)) {
            return fmt::format(
                "--break: invalid condition '{}'; write 'NAME > VALUE', with one of "
                "> < >= <= == !=",
                options.break_condition);
        }
        return "";
    }
    /// Returns true when the execution stops behind its newest cycle.
    bool holds(const JournaledCycle& newest, const std::string& fastest, Session& session) const {
        if (cycle_ && newest.thread == fastest && newest.number >= *cycle_) return true;
        if (time_ns_ && newest.time_ns >= *time_ns_) return true;
        return !name_.empty() && condition(session);
    }
    /// Returns the name in --break that the machine does not have; "" when it has it.
    std::string unknown(const Session& session) const {
        const bool is_known =
            name_.empty() || session.model().find_pin(name_) || session.model().find_signal(name_);
        return is_known ? "" : name_;
    }

private:
    bool parse_until(const std::string& text) {
        std::uint64_t cycle = 0;
        const char* const end = text.data() + text.size();
        const auto [rest, error] = std::from_chars(text.data(), end, cycle);
        if (error == std::errc() && rest == end) {
            cycle_ = cycle;
            return true;
        }
        time_ns_ = parse_duration_ns(text);
        return time_ns_.has_value();
    }

    bool parse_break(const std::string& text) {
        const std::size_t at = text.find_first_of("<>=!");
        if (at == std::string::npos) return false;
        const std::size_t value = text.find_first_not_of("<>=!", at);
        if (value == std::string::npos) return false;
        name_ = text.substr(0, text.find_last_not_of(' ', at == 0 ? 0 : at - 1) + 1);
        operator_ = text.substr(at, value - at);
        char* end = nullptr;
        value_ = std::strtod(text.c_str() + value, &end);
        constexpr std::string_view known[] = {">", "<", ">=", "<=", "==", "!="};
        return at > 0 && !name_.empty() && *end == '\0' && end != text.c_str() + value &&
               std::ranges::find(known, operator_) != std::end(known);
    }

    bool condition(Session& session) const {
        const auto reading = session.values().read({name_}).front();
        if (!reading) return false;
        const double value = real_of(reading->type, reading->value);
        if (operator_ == ">") return value > value_;
        if (operator_ == "<") return value < value_;
        if (operator_ == ">=") return value >= value_;
        if (operator_ == "<=") return value <= value_;
        if (operator_ == "==") return value == value_;
        return value != value_;
    }

    std::optional<std::uint64_t> cycle_;
    std::optional<std::int64_t> time_ns_;
    std::string name_;
    std::string operator_;
    double value_ = 0;
};

/// What was loaded when the journal was written, compared with what would be loaded now.
class JournaledProgram {
public:
    JournaledProgram(const ReplayOptions& options, const JournalFile& file)
        : options_(options), file_(file) {}

    /// Returns an exit status: 1 after printing why the journal is not executed.
    int check() const {
        std::string problems;
        const std::string own = fmt::format("{} {}", paths::version, paths::commit);
        if (const std::string hash = file_hash("/proc/self/exe"); hash != file_.program()) {
            problems += fmt::format(
                "  it was written by another program: {} (hash {}), this is "
                "{} (hash {})\n",
                file_.version(), file_.program(), own, hash);
        }
        for (const ExecutionEntry& entry : file_.entries()) {
            for (const JournaledFile& plugin : entry.files) {
                problems += changed(plugin);
            }
            if (entry.kind == ExecutionEntry::Kind::opened) {
                problems += outside(entry);
            }
        }
        if (problems.empty()) return 0;
        const std::string text =
            fmt::format("'{}' may not be executed exactly:\n{}", options_.words[0], problems);
        if (options_.anyway) {
            note(options_, text.substr(0, text.size() - 1));
            return 0;
        }
        return fail(options_, text +
                                  "  to execute it all the same, type: hal replay --exact "
                                  "--anyway");
    }

    /// Prints which instances may read what the journal does not have.
    void name_readers() const {
        for (const ExecutionEntry& entry : file_.entries()) {
            if (entry.kind != ExecutionEntry::Kind::opened) continue;
            note(options_, fmt::format("'{}' ({}) has {}, whose data are not in the journal: "
                                       "values that depend on them may differ",
                                       entry.instance, entry.component, resources(entry)));
        }
    }

private:
    static std::string changed(const JournaledFile& plugin) {
        const std::string now = file_hash(plugin.path);
        if (now == plugin.hash) return "";
        if (now.empty()) {
            return fmt::format("  the plugin of '{}' is missing: {}\n", plugin.component,
                               plugin.path);
        }
        return fmt::format("  the plugin of '{}' was changed: {} has hash {}, it had {}\n",
                           plugin.component, plugin.path, now, plugin.hash);
    }

    /// Devices and sockets would be opened again, and a machine would move.
    static std::string outside(const ExecutionEntry& entry) {
        if (entry.resources.empty()) return "";
        return fmt::format("  '{}' ({}) opens again: {}\n", entry.instance, entry.component,
                           resources(entry));
    }

    static std::string resources(const ExecutionEntry& entry) {
        std::string text;
        for (const std::string& resource : entry.resources) {
            text += (text.empty() ? "" : ", ") + resource;
        }
        if (entry.threads > 0) {
            text += (text.empty() ? "" : ", ") + counted(entry.threads, "thread");
        }
        if (entry.streams > 0) {
            text += (text.empty() ? "" : ", ") + counted(entry.streams, "stream");
        }
        return text;
    }

    const ReplayOptions& options_;
    const JournalFile& file_;
};

class ExactReplay {
public:
    ExactReplay(const ReplayOptions& options, JournalFile& file, ReExecution& execution,
                HostedMachine& machine, const StopRule& stop)
        : options_(options),
          file_(file),
          execution_(execution),
          machine_(machine),
          stop_(stop),
          fastest_(fastest_thread()) {}

    /// Executes the journal and prints the result. Returns the exit status.
    int run() {
        const auto lock = machine_.session.lock();
        execution_.attach(
            machine_.session,
            [](Transaction& transaction, const Command& command, Diagnostics& diagnostics) {
            apply_edit(transaction, command, diagnostics);
        }, [this](const std::vector<std::string>& names) { begin_values(names); });
        const auto begun = std::chrono::steady_clock::now();
        const bool stopped = execute();
        const auto took = std::chrono::steady_clock::now() - begun;
        if (values_) {
            values_->compare();
        }
        const int status = report(stopped, took);
        show();
        execution_.finish();
        return status;
    }

private:
    std::string fastest_thread() const {
        const auto& threads = file_.threads();
        const auto fastest = std::ranges::min_element(
            threads, {}, [](const auto& entry) { return entry.second.period_ns; });
        return fastest == threads.end() ? "" : fastest->second.name;
    }

    void begin_values(const std::vector<std::string>& names) {
        values_ = std::make_unique<ValueCheck>(options_.words[0], file_.unix_offset_ns());
        if (values_->problem().empty()) {
            values_->begin(machine_.session, names);
        }
        if (!values_->problem().empty()) {
            note(options_, "the recorded values are not compared: " + values_->problem());
        }
    }

    /// Returns true when a rule or the user has stopped it before the end.
    bool execute() {
        constexpr std::uint64_t compare_every = 256;
        for (std::uint64_t cycle = 1;; ++cycle) {
            if (execution_.advance() != ReExecution::State::goes_on) return false;
            if (values_ && cycle % compare_every == 0 && !values_->compare()) return false;
            if (machine_.stop.requested()) return true;
            if (stop_.holds(execution_.newest(), fastest_, machine_.session)) return true;
        }
    }

    int report(bool stopped, std::chrono::steady_clock::duration took) {
        const JournaledCycle& newest = execution_.newest();
        const double real = std::max(std::chrono::duration<double>(took).count(), 1e-9);
        std::string text = fmt::format(
            "{} of {}, {} and {:.6g} s executed in {:.3g} s; newest: cycle {} of '{}' at {:.6f} "
            "s\n",
            counted(execution_.cycles(), "cycle"), counted(file_.threads().size(), "thread"),
            counted(execution_.edits(), "edit"), seconds(newest.time_ns), real, newest.number,
            newest.thread, seconds(newest.time_ns));
        note_overlaps();
        const std::string difference = difference_text();
        const bool differs = !difference.empty();
        bool good = !differs;
        if (differs) {
            text += difference;
        } else if (execution_.state() == ReExecution::State::fails) {
            good = false;
            text += execution_.reason() + "\n";
        } else if (execution_.state() == ReExecution::State::ends) {
            good = !file_.complete() && !has_gap();
            text += "the journal ends: " + execution_.reason() + "\n";
        } else {
            text += verdict(stopped);
        }
        if (const std::string unknown = stop_.unknown(machine_.session); !unknown.empty()) {
            note(options_, fmt::format("--break: the machine has no '{}'", unknown));
            good = false;
        }
        if (!print(text)) return 1;
        return good ? 0 : 1;
    }

    void note_overlaps() const {
        const std::uint64_t overlaps = execution_.overlaps();
        if (overlaps == 0) return;
        const JournaledCycle& first = execution_.first_overlap();
        const std::string times = overlaps == 1 ? "once" : fmt::format("{} times", overlaps);
        note(options_,
             fmt::format("functions that share state in two threads ran at the same time {}, "
                         "first in cycle {} of '{}' at {:.6f} s; what one read of the other there "
                         "is unknown",
                         times, first.number, first.thread, seconds(first.time_ns)));
    }

    bool has_gap() const {
        return std::ranges::any_of(file_.threads(),
                                   [](const auto& entry) { return !entry.second.gap().empty(); });
    }

    std::string verdict(bool stopped) const {
        const std::string where = stopped ? "stopped; no difference so far" : "no difference";
        if (!values_) return where + "\n";
        return fmt::format("{}, {} compared\n", where, counted(values_->values(), "value"));
    }

    /// Names the first difference; "" when there is none.
    std::string difference_text() const {
        if (values_ && values_->difference()) return value_text(*values_->difference());
        if (execution_.state() != ReExecution::State::differs) return "";
        const JournaledCycle& at = execution_.newest();
        const bool reads = execution_.match() == CycleInputs::Match::other_reads;
        return fmt::format(
            "first difference: cycle {} of thread '{}' at {:.6f} s {}\n{}", at.number, at.thread,
            seconds(at.time_ns),
            reads ? "reads another number of inputs" : "has values with another checksum",
            values_ ? "" : "to have the value named, write the journal with: --values '*'\n");
    }

    std::string value_text(const ValueDifference& at) const {
        const auto text = [&at](std::uint64_t word) {
            return format_exact(at.type, hal_value{.raw = word});
        };
        const std::string others =
            at.others == 0
                ? ""
                : fmt::format(", and {} of the same cycle", counted(at.others, "further value"));
        return fmt::format(
            "first difference: '{}'{} in cycle {} of thread '{}': {} instead of "
            "{}{}\n",
            at.name, function_text(at.name), at.cycle, at.thread, text(at.executed),
            text(at.recorded), others);
    }

    /// Returns " (instance 'x' of pid, function 'x.do-pid-calcs')" of what computes the value.
    std::string function_text(const std::string& name) const {
        const Model& model = machine_.session.model();
        const Pin* pin = model.find_pin(name);
        if (const Signal* const signal = pin ? pin->signal : model.find_signal(name);
            signal && signal->writer) {
            pin = signal->writer;
        }
        if (!pin || !pin->instance) return "";
        const Instance& instance = *pin->instance;
        std::string text = fmt::format(" ('{}' of {}", instance.name, instance.component->name);
        const LoadedFunction* function = pin->function;
        if (!function && !instance.functions.empty()) {
            function = instance.functions.front();
        }
        if (function) {
            text += fmt::format(", function '{}'", function->name);
        }
        return text + ")";
    }

    void show() {
        const std::vector<std::string> names = names_in(options_.show);
        const auto readings = machine_.session.values().read(names);
        std::string text;
        for (std::size_t i = 0; i < names.size(); ++i) {
            const std::string value =
                readings[i] ? format_value(readings[i]->type, readings[i]->value) : "unknown";
            text += fmt::format("{} {}\n", names[i], value);
        }
        print(text);
    }

    const ReplayOptions& options_;
    JournalFile& file_;
    ReExecution& execution_;
    HostedMachine& machine_;
    const StopRule& stop_;
    const std::string fastest_;
    std::unique_ptr<ValueCheck> values_;
};

}  // namespace

int run_exact_replay(const ReplayOptions& options) {
    if (options.words.size() != 1) {
        return fail(options, "--exact takes one journal and no netlist: the journal has the edits");
    }
    StopRule stop;
    if (const std::string problem = stop.parse(options); !problem.empty()) {
        return fail(options, problem);
    }
    JournalFile file;
    if (!file.open(options.words[0])) {
        return fail(options,
                    fmt::format("cannot execute '{}': {}", options.words[0], file.problem()));
    }
    for (const std::string& text : file.notes()) {
        note(options, text);
    }
    const JournaledProgram program(options, file);
    if (const int status = program.check(); status != 0) return status;
    program.name_readers();
    ReExecution execution(file);
    ReplayOptions machine_options = options;
    machine_options.words.clear();
    HostedMachine machine(machine_options, fmt::format("replay-{}", ::getpid()), true,
                          {.schedule = &execution});
    return ExactReplay(options, file, execution, machine, stop).run();
}

}  // namespace hal::tools
