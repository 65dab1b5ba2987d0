// SPDX-License-Identifier: MIT
#include "run/run_journal.hpp"

#include <atomic>
#include <chrono>
#include <filesystem>
#include <fmt/core.h>
#include <memory>
#include <optional>
#include <thread>

#include "cli/output.hpp"
#include "commands/files.hpp"
#include "journal/execution_journal.hpp"
#include "journal/journal_ring.hpp"
#include "paths.hpp"
#include "recording/mcap/held_file.hpp"
#include "run/chosen_values.hpp"
#include "run/hosted_machine.hpp"
#include "run/journal_option.hpp"
#include "run/sim_summary.hpp"
#include "run/values_check.hpp"
#include "text/quoting.hpp"

namespace hal::tools {
namespace {

/// Takes the rows of a probe in a thread of its own, and writes them to the file of a journal.
class RecordedValues {
public:
    RecordedValues(Session& session, ExecutionJournal& journal)
        : session_(session), journal_(journal) {}
    ~RecordedValues() { end(); }

    /// Returns why the values cannot be recorded; "" when they are.
    std::string begin(const std::vector<std::string>& patterns) {
        const auto lock = session_.lock();
        if (std::string unknown = unknown_value(session_.model(), patterns); !unknown.empty()) {
            return "--values: " + unknown;
        }
        std::vector<std::string> names = chosen_values(session_.model(), patterns);
        std::string problem;
        probe_ = session_.probes().attach({.names = names, .advice = fewer_values}, problem);
        if (!probe_) return "--values: " + problem;
        journal_.sampled(std::move(names));
        layout_ = Probes::layout(*probe_);
        journal_.with_writer([this](mcap::Writer& writer) {
            sink_ = make_mcap_sink(writer, Probes::columns(*probe_),
                                   {.instance = {},
                                    .version = {},
                                    .netlist = {},
                                    .cause = {},
                                    .unix_offset_ns = journal_.unix_offset_ns()});
            sink_->layout(layout_.groups);
        });
        thread_ = std::thread([this] {
            while (!ends_) {
                std::this_thread::sleep_for(std::chrono::milliseconds(50));
                take(Probes::Rest::stays);
            }
        });
        return "";
    }
    void end() {
        if (!thread_.joinable()) return;
        ends_ = true;
        thread_.join();
        take(Probes::Rest::taken);
        const auto lock = session_.lock();
        session_.probes().detach(probe_);
    }

private:
    void take(Probes::Rest rest) {
        std::vector<ProbeRows> batches;
        {
            const auto lock = session_.lock();
            batches = session_.probes().take(*probe_, std::size_t{1} << 24, rest);
        }
        journal_.with_writer([&](mcap::Writer&) {
            for (const ProbeRows& rows : batches) {
                add_rows(*sink_, rows, layout_, rows_);
            }
        });
    }

    Session& session_;
    ExecutionJournal& journal_;
    std::shared_ptr<LiveProbe> probe_;
    ProbeLayout layout_;
    std::unique_ptr<Sink> sink_;
    std::uint64_t rows_ = 0;
    std::atomic<bool> ends_{false};
    std::thread thread_;
};

class FileOfRun final : public RunJournal {
public:
    explicit FileOfRun(const RunOptions& options)
        : options_(options),
          ring_(ring_of(options)),
          journal_(ring_ ? ring_->first() : options.journal,
                   {own_name(options), std::string(paths::version), std::string(paths::commit)}) {}

    /// Returns an exit status after printing why the file cannot be written.
    int check() {
        if (ring_ && !ring_->problem().empty()) return fail(options_, ring_->problem());
        if (ring_ && !ring_->kept().empty()) {
            note(
                fmt::format("the journal of a machine that was killed is now '{}'", ring_->kept()));
        }
        if (const std::string problem = journal_.problem(); !problem.empty()) {
            return fail(options_, fmt::format("cannot write '{}': {}", options_.journal, problem));
        }
        if (!journal_.kept().empty()) {
            write_all(2, fmt::format("{}: the unfinished journal of an earlier run is now '{}'\n",
                                     options_.program, journal_.kept()));
        }
        keep_previous();
        return 0;
    }

    ExecutionSink& sink() override { return journal_; }

    void begin(HostedMachine& machine) override {
        journal_.on_failure([this](const std::string& reason) {
            write_all(2, fmt::format("{}: cannot write '{}': {}; the machine goes on without a "
                                     "journal\n",
                                     options_.program, options_.journal, reason));
        });
        if (ring_) {
            begin_ring(machine.session);
        }
        std::vector<std::string> files = options_.words;
        if (!options_.ini.empty()) {
            files.push_back(options_.ini);
        }
        for (const std::string& path : files) {
            std::string text;
            std::string ignored;
            if (read_text_file(path, text, ignored)) {
                journal_.attach(path, text);
            }
        }
    }

    int begin_values(HostedMachine& machine) override {
        const std::vector<std::string> patterns = names_in(options_.values);
        if (patterns.empty()) return 0;
        values_ = std::make_unique<RecordedValues>(machine.session, journal_);
        const std::string problem = values_->begin(patterns);
        return problem.empty() ? 0 : fail(options_, problem);
    }

    void end_values() override {
        values_.reset();
        if (ring_) {
            ring_->end();
        }
    }

    int end() override {
        const bool written = journal_.close();
        for (const auto& [thread, lost] : journal_.lost()) {
            write_all(2, fmt::format("{}: thread '{}': {} did not fit the buffer of the journal; "
                                     "hal replay --exact ends before the first of them\n",
                                     options_.program, thread, counted(lost, "cycle")));
        }
        if (!written) {
            return fail(options_, fmt::format("cannot write '{}': {}; what was written is in '{}'",
                                              options_.journal, journal_.problem(),
                                              ring_ ? ring_->folder() : journal_.where()));
        }
        if (!ring_) {
            write_all(
                2, fmt::format("{}: {}\n", options_.journal, counted(journal_.cycles(), "cycle")));
            return 0;
        }
        const std::string problem = ring_->finish();
        if (!problem.empty()) {
            return fail(options_, fmt::format("cannot write '{}': {}; what was written is in '{}'",
                                              options_.journal, problem, ring_->folder()));
        }
        write_all(2, fmt::format("{}: the last {} of {}\n", options_.journal,
                                 format_duration(static_cast<double>(options_.keep_ns)),
                                 counted(journal_.cycles(), "cycle")));
        return 0;
    }

private:
    static std::unique_ptr<JournalRing> ring_of(const RunOptions& options) {
        return options.keep_ns > 0 ? std::make_unique<JournalRing>(options.journal, options.keep_ns)
                                   : nullptr;
    }
    void note(const std::string& text) const {
        write_all(2, fmt::format("{}: {}\n", options_.program, text));
    }
    void begin_ring(Session& session) {
        const auto faults = [&session]() -> std::optional<std::uint64_t> {
            const auto lock = session.try_lock();
            if (!lock.owns_lock()) return std::nullopt;
            return session.reports().fault_count();
        };
        ring_->begin(journal_, {[this](const std::string& text) { note(text); }, faults});
        journal_.on_save([this](const std::string& path) { return ring_->save(path); });
    }
    /// The complete journal of an earlier run is kept, one of them: a machine that starts again
    /// after a fault must not replace what happened before it.
    void keep_previous() const {
        const std::filesystem::path path = options_.journal;
        std::error_code error;
        if (!std::filesystem::is_regular_file(std::filesystem::symlink_status(path, error))) return;
        std::filesystem::path previous = path;
        previous.replace_filename(path.stem().string() + "-previous.mcap");
        std::filesystem::rename(path, previous, error);
        const std::string result =
            error ? fmt::format(
                        "'{}' of an earlier run is replaced at the end of this one, because "
                        "it cannot be renamed: {}",
                        options_.journal, error.message())
                  : fmt::format("the journal of an earlier run is now '{}'", previous.string());
        write_all(2, fmt::format("{}: {}\n", options_.program, result));
    }

    const RunOptions& options_;
    const std::unique_ptr<JournalRing> ring_;  // nullptr: the journal is kept whole
    ExecutionJournal journal_;
    std::unique_ptr<RecordedValues> values_;
};

}  // namespace

int run_journaled(const RunOptions& given) {
    RunOptions options = given;
    add_journal_of_netlists(options);
    if (!options.values.empty() && !options.journal.empty()) {
        const std::string problem = problem_of_values(options, options.values);
        if (!problem.empty()) return fail(options, "--values: " + problem);
    }
    return run_with_journal(
        options, [&options](RunJournal* journal) { return run_machine(options, journal); });
}

int run_with_journal(const RunOptions& options, const std::function<int(RunJournal*)>& run) {
    if (options.journal.empty()) return run(nullptr);
    if (!options.journal.ends_with(".mcap")) {
        return fail(options, fmt::format("--journal: unknown format of '{}'; name the file .mcap",
                                         options.journal));
    }
    if (const std::string problem = mcap::unwritable(options.journal); !problem.empty()) {
        return fail(options, fmt::format("cannot write '{}': {}", options.journal, problem));
    }
    if (options.keep_ns > 0 && !options.values.empty()) {
        return fail(options,
                    "--journal-keep and --values exclude each other: a journal that begins "
                    "later has no recorded values");
    }
    FileOfRun journal(options);
    if (const int status = journal.check(); status != 0) return status;
    const int status = run(&journal);
    const int end_status = journal.end();
    return status != 0 ? status : end_status;
}

}  // namespace hal::tools
