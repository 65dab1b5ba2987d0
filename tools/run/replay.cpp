// SPDX-License-Identifier: MIT
#include "run/replay.hpp"

#include <algorithm>
#include <bit>
#include <chrono>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fmt/core.h>
#include <fnmatch.h>
#include <limits>
#include <map>
#include <set>
#include <unistd.h>
#include <utility>

#include "cli/output.hpp"
#include "journal/journal_file.hpp"
#include "recording/mcap/playback_pin.hpp"
#include "recording/mcap/recording.hpp"
#include "run/chosen_values.hpp"
#include "run/exact_replay.hpp"
#include "run/hosted_machine.hpp"
#include "run/journal_test.hpp"
#include "run/sim_summary.hpp"
#include "text/quoting.hpp"
#include "text/suggest.hpp"

namespace hal::tools {
namespace {

constexpr const char* player = "replay";  // the instance of playback

bool matches(const std::string& list, const std::string& name) {
    for (std::size_t at = 0; at <= list.size();) {
        const std::size_t end = std::min(list.find(',', at), list.size());
        if (::fnmatch(list.substr(at, end - at).c_str(), name.c_str(), 0) == 0) return true;
        at = end + 1;
    }
    return false;
}

double real_of(hal_type type, std::uint64_t word) {
    if (type == HAL_TYPE_FLOAT) return std::bit_cast<double>(word);
    return type == HAL_TYPE_S32 || type == HAL_TYPE_S64
               ? static_cast<double>(static_cast<std::int64_t>(word))
               : static_cast<double>(word);
}

/// A recorded value that the netlist computes itself.
struct Compared {
    std::string name;
    const mcap::Table* table;
    std::size_t column;
    std::size_t row = 0;
    std::size_t rows = 0;     // the next recorded row; compared so far
    double worst = 0;
    double recorded = 0;
    double replayed = 0;
    std::int64_t at_ns = 0;
};

/// An instance of playback, for the values that one thread recorded.
struct Player {
    std::string name;
    std::int64_t period_ns;  // of its thread
    const mcap::Table* table;
};

/// Returns the usual time between two rows; 0 for a single row.
std::int64_t median_period_ns(const mcap::Table& table) {
    std::vector<std::int64_t> periods;
    for (std::size_t row = 1; row < table.rows(); ++row) {
        periods.push_back(table.times_ns[row] - table.times_ns[row - 1]);
    }
    if (periods.empty()) return 0;
    const auto middle = periods.begin() + static_cast<std::ptrdiff_t>(periods.size() / 2);
    std::nth_element(periods.begin(), middle, periods.end());
    return *middle;
}

/// A time without rows, counted from the first row.
struct Gap {
    std::int64_t begin_ns = 0;
    std::int64_t end_ns = 0;
    std::int64_t length_ns() const { return end_ns - begin_ns; }
};

Gap max_gap(const mcap::Recording& recording) {
    std::vector<std::int64_t> times;
    for (const mcap::Table& table : recording.tables) {
        times.insert(times.end(), table.times_ns.begin(), table.times_ns.end());
    }
    std::sort(times.begin(), times.end());
    Gap max;
    for (std::size_t i = 1; i < times.size(); ++i) {
        const Gap gap{times[i - 1] - recording.begin_ns(), times[i] - recording.begin_ns()};
        if (gap.length_ns() > max.length_ns()) {
            max = gap;
        }
    }
    return max;
}

/// Prints how far a long replay is: after 5 s, then every minute.
class Progress {
public:
    Progress(std::string program, std::int64_t all_ns)
        : program_(std::move(program)), all_ns_(all_ns) {}
    void report(std::int64_t done_ns) {
        const auto now = std::chrono::steady_clock::now();
        if (now < due_) return;
        due_ = now + std::chrono::minutes(1);
        const double all = static_cast<double>(all_ns_) * 1e-9;
        const double done = static_cast<double>(done_ns) * 1e-9;
        write_all(STDERR_FILENO,
                  fmt::format("{}: {:.6g} s of {:.6g} s replayed; Ctrl-C ends it with a report\n",
                              program_, done, all));
    }

private:
    const std::string program_;
    const std::int64_t all_ns_;
    std::chrono::steady_clock::time_point due_ =
        std::chrono::steady_clock::now() + std::chrono::seconds(5);
};

class Replay {
public:
    Replay(const ReplayOptions& options, mcap::Recording& recording, HostedMachine& machine)
        : options_(options), recording_(recording), machine_(machine) {}

    /// Connects the player to what has no writer. Returns the exit status.
    int connect(const std::string& file) {
        std::vector<std::vector<std::string>> commands{{"loadrt", "playback", "", "file=" + file}};
        if (const std::string unknown = unknown_name(); !unknown.empty()) {
            return fail(options_, unknown);
        }
        if (file.ends_with(".csv")) {
            std::string problem;
            const std::string types = apply_types(problem);
            if (!problem.empty()) return fail(options_, problem);
            if (!types.empty()) {
                commands[0].push_back("types=" + types);
            }
        }
        {
            const auto lock = machine_.session.lock();
            const Model& model = machine_.session.model();
            if (model.threads.empty()) return fail(options_, "the netlist has no thread");
            if (!options_.thread.empty() && !model.find_thread(options_.thread)) {
                return fail(options_, fmt::format("unknown thread '{}'", options_.thread));
            }
            assign_players(model);
            std::string names;
            for (const auto& [thread, one] : players_) {
                append_item(names, one.name, ",");
                commands.push_back({"setp", one.name + ".begin", std::to_string(origin_ns_)});
                commands.push_back({"addf", one.name + ".update", thread, "1"});
            }
            commands[0][2] = "names=" + names;
            for (const mcap::Table& table : recording_.tables) {
                for (std::size_t c = 0; c < table.columns.size(); ++c) {
                    use(model, table, c, commands);
                }
            }
        }
        if (driven_.empty()) {
            return fail(options_,
                        "nothing of the recording is an input of the netlist: no value in it is a "
                        "signal without a writer, or an input pin "
                        "without a signal");
        }
        // what playback warns of the file has been printed
        TextOutput of_loading;
        if (const int status = machine_.shell.execute({commands.front()}, of_loading, "<replay>");
            status != 0) {
            write_all(STDERR_FILENO, of_loading.err_text);
            return status;
        }
        commands.erase(commands.begin());
        ProcessOutput output;
        return machine_.shell.execute(commands, output, "<replay>");
    }

    /// Runs the netlist over the recording and compares.
    int run() {
        std::vector<std::string> names;
        for (const Compared& one : compared_) {
            names.push_back(one.name);
        }
        std::shared_ptr<LiveProbe> probe;
        if (!names.empty()) {
            const auto lock = machine_.session.lock();
            std::string problem;
            probe = machine_.session.probes().attach({names}, problem);
            if (!probe) return fail(options_, problem);
            layout_ = Probes::layout(*probe);
        }
        machine_.start_threads();
        const std::int64_t all_ns = recording_.end_ns() - recording_.begin_ns();
        const std::int64_t wanted_ns =
            options_.for_ns < 0 ? all_ns : std::min(options_.for_ns, all_ns);
        constexpr std::int64_t step_ns = 200'000'000;
        warn_of_gap(wanted_ns);
        Progress progress(options_.program, wanted_ns);
        const std::int64_t until_ns = origin_ns_ + wanted_ns;
        for (std::int64_t left_ns = until_ns - machine_.session.threads().now_ns();
             left_ns > 0 && !machine_.stop.requested(); left_ns -= step_ns) {
            machine_.advance(std::min(step_ns, left_ns), 0);
            replayed_ns_ = std::clamp<std::int64_t>(wanted_ns - left_ns + step_ns, 0, wanted_ns);
            progress.report(replayed_ns_);
            if (!probe) continue;
            const auto lock = machine_.session.lock();
            for (const ProbeRows& rows :
                 machine_.session.probes().take(*probe, max_taken, Probes::Rest::taken)) {
                compare(rows, wanted_ns);
            }
        }
        return machine_.faulted() || machine_.stop.requested() ? 1 : 0;
    }

    /// Prints the result. Returns the exit status.
    int report(int status) {
        std::size_t width = 0;
        for (const Compared& one : compared_) {
            width = std::max(width, one.name.size());
        }
        std::string text;
        std::size_t different = 0;
        std::size_t rows = 0;
        for (const Compared& one : compared_) {
            const bool differs = options_.tolerance >= 0 && !(one.worst <= options_.tolerance);
            different += differs;
            rows += one.rows;
            if (options_.quiet && !differs) continue;
            if (one.rows == 0) {
                text += fmt::format("{:{}}  no row at the same time\n", one.name, width);
            } else if (one.worst == 0) {
                text +=
                    fmt::format("{:{}}  equal in {}\n", one.name, width, counted(one.rows, "row"));
            } else {
                text += fmt::format(
                    "{:{}}  differs by up to {:.6g}: {:.6g} instead of {:.6g} at {:.6f} s\n",
                    one.name, width, one.worst, one.replayed, one.recorded,
                    static_cast<double>(one.at_ns) * 1e-9);
            }
        }
        const double seconds =
            static_cast<double>(recording_.end_ns() - recording_.begin_ns()) * 1e-9;
        const double wanted = options_.for_ns < 0
                                  ? seconds
                                  : std::min(seconds, static_cast<double>(options_.for_ns) * 1e-9);
        const double replayed = static_cast<double>(replayed_ns_) * 1e-9;
        const bool nothing = options_.tolerance >= 0 && rows == 0;  // a test that tests nothing
        if (!options_.quiet || different != 0 || nothing) {
            text += fmt::format(
                "{} s of {}: {} driven, {} compared{}\n",
                machine_.stop.requested()
                    ? fmt::format("interrupted after {:.6g} s of {:.6g}", replayed, wanted)
                    : fmt::format("{:.6g}", wanted),
                recording_.missing.empty() ? "recording" : "an incomplete recording",
                counted(driven_.size(), "input"), counted(compared_.size(), "value"),
                verdict(nothing, different));
        }
        if (!print(text)) return 1;
        return different != 0 || nothing ? 1 : status;
    }

private:
    /// What the last line of the report adds about the comparison.
    std::string verdict(bool nothing, std::size_t different) const {
        if (options_.tolerance < 0) return "";
        if (nothing) return ": nothing was tested; record values that the netlist computes too";
        if (different == 0) return ", none differs";
        const std::string_view verb = different == 1 ? "differs" : "differ";
        return fmt::format(", {} {} by more than {:g}", different, verb, options_.tolerance);
    }

    /// A gap is replayed like the rest: a clock that jumped makes hours of it.
    void warn_of_gap(std::int64_t wanted_ns) const {
        constexpr std::int64_t long_gap_ns = 600'000'000'000;
        const Gap gap = max_gap(recording_);
        if (gap.length_ns() < long_gap_ns || gap.begin_ns >= wanted_ns) return;
        const double begin = static_cast<double>(gap.begin_ns) * 1e-9;
        write_all(
            STDERR_FILENO,
            fmt::format("{}: the recording has no row between {:.6g} s and {:.6g} s, and the "
                        "netlist runs all that time; to end before the gap, type: --for "
                        "{:.6f}s\n",
                        options_.program, begin, static_cast<double>(gap.end_ns) * 1e-9, begin));
    }

    std::vector<std::string> recorded_names() const {
        std::vector<std::string> names;
        for (const mcap::Table& table : recording_.tables) {
            for (const mcap::Column& column : table.columns) {
                names.push_back(column.name);
            }
        }
        return names;
    }

    /// States which name or pattern of --names the recording does not have; "" when it has all.
    std::string unknown_name() const {
        const std::vector<std::string> names = recorded_names();
        for (const std::string& one : names_in({options_.names})) {
            if (std::any_of(names.begin(), names.end(),
                            [&](const std::string& name) { return matches(one, name); })) {
                continue;
            }
            const std::string hint = suggestion(one, names, "it has");
            return fmt::format("--names: the recording has no value '{}'{}", one,
                               hint.empty() ? "" : "; " + hint);
        }
        return "";
    }

    static hal_type type_of(const Model& model, const std::string& name) {
        if (const Pin* const pin = model.find_pin(name)) return pin->type;
        const Signal* const signal = model.find_signal(name);
        return signal ? signal->type : HAL_TYPE_FLOAT;
    }

    /// A table has no types: its values get those that the netlist has. Returns them as playback's
    /// argument.
    std::string apply_types(std::string& problem) {
        mcap::LoadOptions options;
        std::string text;
        {
            const auto lock = machine_.session.lock();
            const Model& model = machine_.session.model();
            for (const std::string& name : recorded_names()) {
                const hal_type type = type_of(model, name);
                if (type == HAL_TYPE_FLOAT || type == HAL_TYPE_PORT ||
                    !matches(options_.names, name)) {
                    continue;
                }
                options.types[name] = type;
                append_item(text, name + ":" + hal::name(type), ",");
            }
        }
        mcap::Recording typed;
        if (mcap::load(options_.words.front(), typed, problem, options)) {
            recording_ = std::move(typed);
        }
        return text;
    }

    /// Returns the thread that an .mcap names; nullptr: the file does not name one, or the netlist
    /// does not have it.
    const Thread* named_thread(const Model& model, const mcap::Table& table) const {
        if (!options_.thread.empty()) return model.find_thread(options_.thread);
        const std::string topic = table.topic.starts_with("/hal/") ? table.topic.substr(5) : "";
        return model.find_thread(table.thread.empty() ? topic : table.thread);
    }

    /// Returns the thread in which the netlist computes a value of the table; nullptr for none.
    const Thread* computing_thread(const Model& model, const mcap::Table& table) const {
        for (const mcap::Column& column : table.columns) {
            const Pin* const pin = model.find_pin(column.name);
            const Signal* const signal = pin ? pin->signal : model.find_signal(column.name);
            const Pin* const source = signal ? signal->writer : pin;
            if (!source || (source->dir != HAL_DIR_OUT)) continue;
            if (const Thread* const thread = hal::thread_of(*source)) return thread;
        }
        return nullptr;
    }

    static std::vector<const Thread*> threads_of_period(const Model& model,
                                                        std::int64_t period_ns) {
        std::vector<const Thread*> found;
        for (const auto& thread : model.threads) {
            if (thread->options.period_ns == period_ns) {
                found.push_back(thread.get());
            }
        }
        return found;
    }

    /// Assigns each table the thread that recorded it, because others get a value as late as they
    /// did in the machine. A .csv names no thread: it is the one with the period of the rows; of
    /// several, the one that computes a value of the table, or that is left for it.
    void assign_threads(const Model& model) {
        std::vector<const mcap::Table*> open;
        for (const mcap::Table& table : recording_.tables) {
            const Thread* thread = named_thread(model, table);
            const auto same = threads_of_period(model, median_period_ns(table));
            if (!thread && same.size() == 1) {
                thread = same.front();
            }
            if (!thread) {
                const Thread* const computing = computing_thread(model, table);
                const bool is_one =
                    same.empty() || std::ranges::find(same, computing) != same.end();
                thread = is_one ? computing : nullptr;
            }
            if (thread) {
                threads_[&table] = thread;
            } else {
                open.push_back(&table);
            }
        }
        for (const mcap::Table* const table : open) {
            threads_[table] = &remaining_thread(model, *table);
        }
    }

    /// Returns the thread of the table's period that recorded no other table; reports when it is a
    /// guess. Without a thread of the period, the fastest one.
    const Thread& remaining_thread(const Model& model, const mcap::Table& table) const {
        auto same = threads_of_period(model, median_period_ns(table));
        if (same.empty()) return *model.threads.front();
        const Thread* const first = same.front();
        std::erase_if(same, [this](const Thread* thread) {
            return std::ranges::any_of(threads_,
                                       [&](const auto& one) { return one.second == thread; });
        });
        if (same.size() == 1) return *same.front();
        const Thread& chosen = same.empty() ? *first : *same.front();
        write_all(
            STDERR_FILENO,
            fmt::format("{}: the recording does not name the thread of '{}', and several have "
                        "the period of its rows; it is played in '{}'. To choose another "
                        "thread, type: --thread NAME; an .mcap names it\n",
                        options_.program, table.columns.front().name, chosen.name));
        return chosen;
    }

    /// Returns the thread that recorded a table.
    const Thread& thread_of(const mcap::Table& table) const { return *threads_.at(&table); }

    /// Assigns a player to each thread that recorded something.
    void assign_players(const Model& model) {
        assign_threads(model);
        for (const mcap::Table& table : recording_.tables) {
            const Thread& thread = thread_of(table);
            const std::string name =
                players_.empty() ? player : fmt::format("{}-{}", player, thread.name);
            players_.try_emplace(thread.name, Player{name, thread.options.period_ns, &table});
        }
        origin_ns_ = origin_ns(machine_.session.threads().now_ns());
    }

    /// Returns the time of the machine at which the first row is due: all rows are due in a cycle
    /// of their thread, if the periods allow it, or else those of the fastest thread.
    std::int64_t origin_ns(std::int64_t now_ns) const {
        const auto first_ns = [this](const Player& one) {
            return one.table->times_ns.front() - recording_.begin_ns();
        };
        const auto origin_for = [&](const Player& one) {
            const std::int64_t cycles = (now_ns + first_ns(one)) / one.period_ns + 1;
            return cycles * one.period_ns - first_ns(one);
        };
        const auto by_period = [](const auto& a, const auto& b) {
            return a.second.period_ns < b.second.period_ns;
        };
        const auto [fastest, slowest] = std::ranges::minmax_element(players_, by_period);
        const std::int64_t origin = origin_for(slowest->second);
        const bool fits = std::ranges::all_of(players_, [&](const auto& one) {
            return (origin + first_ns(one.second)) % one.second.period_ns == 0;
        });
        return fits ? origin : origin_for(fastest->second);
    }

    /// Decides what a recorded column is for: it drives a signal without a writer or an input
    /// without a signal; what else the machine has under its name is compared.
    void use(const Model& model, const mcap::Table& table, std::size_t c,
             std::vector<std::vector<std::string>>& commands) {
        const mcap::Column& column = table.columns[c];
        if (!matches(options_.names, column.name)) return;
        const Pin* const pin = model.find_pin(column.name);
        const Signal* const signal = pin ? pin->signal : model.find_signal(column.name);
        if (!pin && !signal) return;
        if (pin && is_time(*pin)) return;
        const std::string& name = signal ? signal->name : pin->name;
        if (signal && !signal->writer && signal->ios == 0) {
            if (!driven_.insert(name).second) return;
            commands.push_back({"net", name, source_of(table, column)});
        } else if (!signal && pin->dir == HAL_DIR_IN) {
            if (!driven_.insert(name).second) return;
            commands.push_back(
                {"net", fmt::format("{}:{}", player, name), source_of(table, column), name});
        } else if (!is_parameter(pin) && !driven_.contains(name) &&
                   seen_.insert(column.name).second) {
            compared_.push_back({column.name, &table, c});
        }
    }

    /// Measured times are never the same.
    static bool is_time(const Pin& pin) { return pin.of_thread || pin.function; }
    static bool is_parameter(const Pin* pin) { return pin && pin->dir == HAL_DIR_PARAM; }

    /// The pin of the player that gives a recorded column.
    std::string source_of(const mcap::Table& table, const mcap::Column& column) const {
        const std::string& name = players_.at(thread_of(table).name).name;
        return fmt::format("{}.{}", name, playback_pin(column.name));
    }

    // Recorded times count from the first row, replayed ones from when it is due. A recorded row is
    // compared with the row of the same time.
    void compare(const ProbeRows& rows, std::int64_t wanted_ns) {
        if (rows.layout) {
            layout_ = *rows.layout;
        }
        std::size_t at = 0;
        for (const auto& part : rows.parts) {
            const auto& columns = layout_.groups[part.group].columns;
            const std::size_t words = columns.size() + 2;
            for (std::size_t i = 0; i < part.rows; ++i, at += words * 8) {
                std::vector<std::uint64_t> row(words);
                std::memcpy(row.data(), rows.bytes.data() + at, words * 8);
                const std::int64_t time_ns = static_cast<std::int64_t>(row[1]) - origin_ns_;
                if (time_ns > wanted_ns) continue;
                for (std::size_t k = 0; k < columns.size(); ++k) {
                    compare(compared_[columns[k]], time_ns, row[k + 2]);
                }
            }
        }
    }

    /// Returns how far two values are apart: 0 for equal ones and two NaN, infinity for one NaN.
    static double difference(double recorded, double replayed) {
        if (std::isnan(recorded) != std::isnan(replayed)) {
            return std::numeric_limits<double>::infinity();
        }
        if (recorded == replayed || std::isnan(recorded)) return 0.0;
        return std::abs(recorded - replayed);
    }
    void compare(Compared& one, std::int64_t time_ns, std::uint64_t word) const {
        const auto& times = one.table->times_ns;
        while (one.row < times.size() && times[one.row] - recording_.begin_ns() < time_ns) {
            ++one.row;
        }
        if (one.row >= times.size() || times[one.row] - recording_.begin_ns() != time_ns) return;
        while (one.row + 1 < times.size() && times[one.row + 1] == times[one.row]) {
            ++one.row;  // the newest of this time
        }
        const hal_type type = one.table->columns[one.column].type;
        const double recorded = one.table->real(one.row, one.column);
        const double replayed = real_of(type, word);
        ++one.rows;
        const double apart = difference(recorded, replayed);
        if (apart <= one.worst) return;
        one.worst = apart;
        one.recorded = recorded;
        one.replayed = replayed;
        one.at_ns = time_ns;
    }

    const ReplayOptions& options_;
    mcap::Recording& recording_;
    HostedMachine& machine_;
    std::set<std::string> driven_, seen_;
    std::vector<Compared> compared_;
    ProbeLayout layout_;
    std::map<const mcap::Table*, const Thread*> threads_;  // that recorded the tables
    std::map<std::string, Player> players_;  // by the name of their thread
    std::int64_t origin_ns_ = 0;  // of the machine's clock, at the first row
    std::int64_t replayed_ns_ = 0;
};

/// Returns the given options that work with --exact only: "--until, --show".
std::string exact_options(const ReplayOptions& options) {
    const std::pair<const char*, bool> all[] = {
        {"--until", !options.until.empty()},
        {"--break", !options.break_condition.empty()},
        {"--show", !options.show.empty()},
        {"--shell", options.shell},
        {"--panel", options.panel},
        {"--edit", !options.edits.empty()},
        {"--netlist", !options.netlist.empty()},
        {"--at", !options.at.empty()},
        {"--as-test", !options.as_test.empty()},
        {"--record", !options.record.empty()},
        {"--cut", !options.cut.empty()},
        {"--anyway", options.anyway},
    };
    std::string list;
    for (const auto& [option, is_given] : all) {
        if (is_given) {
            append_item(list, option);
        }
    }
    return list;
}

bool is_journal(const std::string& path) {
    JournalFile file;
    return file.open(path);
}

int report_missing_netlist(const ReplayOptions& options) {
    const bool may_be_executed = options.words.size() == 1 && is_journal(options.words[0]);
    if (!may_be_executed) return fail(options, "missing netlist: hal replay FILE NETLIST");
    return fail(options, fmt::format("'{0}' is a journal; to execute it again, type: hal replay "
                                     "--exact {0}; to run a netlist with its values, name one: hal "
                                     "replay FILE NETLIST",
                                     options.words[0]));
}

}  // namespace

/// `hal replay`: runs a netlist with the inputs of a recording and compares the outputs; with
/// --exact, executes a journal again.
int run_replay(const ReplayOptions& options) {
    if (options.exact && (options.tolerance >= 0 || options.for_ns >= 0)) {
        return fail(
            options,
            "--exact compares all bits of the whole journal: use --until MOMENT in place of "
            "--for, and no --tolerance");
    }
    if (options.exact) return run_exact_replay(options);
    if (options.words.size() == 1 && is_journal_test(options.words[0])) {
        return run_journal_test(options);
    }
    if (const std::string given = exact_options(options); !given.empty()) {
        return fail(options, fmt::format("only with --exact: {}", given));
    }
    if (options.words.size() < 2) return report_missing_netlist(options);
    const std::string file = std::filesystem::absolute(options.words.front()).string();
    mcap::Recording recording;
    std::string problem;
    if (!mcap::load(options.words.front(), recording, problem)) return fail(options, problem);
    for (const std::string& note : recording.notes()) {
        write_all(STDERR_FILENO, fmt::format("{}: {}\n", options.program, note));
    }
    if (recording.tables.empty()) {
        return fail(options, fmt::format("'{}' has no rows{}", options.words.front(),
                                         recording.unread.empty() ? "" : "; " + recording.unread));
    }
    ReplayOptions netlists = options;
    netlists.words.erase(netlists.words.begin());
    HostedMachine machine(netlists, fmt::format("replay-{}", ::getpid()), true);
    if (!machine.serve(false)) return 1;
    if (const int status = machine.load(); status != 0) return status;
    Replay replay(options, recording, machine);
    if (const int status = replay.connect(file); status != 0) return status;
    return replay.report(replay.run());
}

}  // namespace hal::tools
