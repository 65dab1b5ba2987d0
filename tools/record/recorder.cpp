// SPDX-License-Identifier: MIT
#include "record/recorder.hpp"

#include <algorithm>
#include <cstdio>
#include <deque>
#include <filesystem>
#include <fmt/core.h>

#include "cli/output.hpp"
#include "cli/signals.hpp"
#include "hal/clock.hpp"
#include "machine/processes/address.hpp"
#include "machine/run/probes.hpp"
#include "record/flight.hpp"
#include "record/names.hpp"
#include "record/sink.hpp"
#include "recording/mcap/held_file.hpp"
#include "text/quoting.hpp"

namespace hal::tools {
namespace {

std::string file_size(std::uint64_t bytes) {
    const double size = static_cast<double>(bytes);
    return size < 1e6 ? fmt::format("{:.1f} kB", size * 1e-3)
                      : fmt::format("{:.1f} MB", size * 1e-6);
}

class Recorder {
public:
    Recorder(const Options& options, const Recording& what, Client& client, ProbeClient& probe)
        : options_(options),
          what_(what),
          client_(client),
          probe_(probe),
          origin_{client.instance(), client.version(), client.run("save").out, "",
                  probe.unix_ns(0),  what.profile} {
        client.cancel_on(-1);
    }

    int to_files() {
        if (!open(file_name())) return 1;
        while (!stop_.requested() && !ended_) {
            const auto got = next();
            if (got == ProbeClient::Got::disconnected) return lost_machine();
            if (got == ProbeClient::Got::layout && !sink_->layout(probe_.groups())) {
                return cannot_write();
            }
            if (got == ProbeClient::Got::journal && !sink_->event(probe_.entry())) {
                return cannot_write();
            }
            if (got == ProbeClient::Got::batch && !add()) return cannot_write();
        }
        return finish();
    }

    /// Records only the time around events, each in a file of its own. Returns the status of the
    /// command.
    int flight() {
        if (const std::string problem = mcap::unwritable(what_.file); !problem.empty()) {
            return fail(options_, fmt::format("cannot write '{}': {}", what_.file, problem));
        }
        const std::filesystem::path folder = std::filesystem::path(what_.file).parent_path();
        Flight flight{FlightMemory(probe_.groups(), what_.last_ns),
                      FlightTrigger(what_.last_ns, what_.after_ns),
                      FlightBacklog(folder.empty() ? "." : folder.string())};
        for (bool over = false; !over;) {
            const ProbeClient::Got got = next();
            over = stop_.requested() || got == ProbeClient::Got::disconnected ||
                   (what_.for_ns >= 0 && now_ns_ - first_ns_ >= what_.for_ns);
            accept(got, flight);
            end_event(over, flight);
            flight.backlog.forget(flight.memory.forgotten_until_ns());
            if (over || flight.backlog.may_write(monotonic_ns())) {
                write(flight.memory, flight.backlog);
            }
        }
        if (!flight.backlog.empty() || flight.backlog.lost() != 0) {
            const std::size_t unwritten = flight.backlog.size() + flight.backlog.lost();
            return fail(options_,
                        fmt::format("{} not written: {}", counted(unwritten, "event"), failure_));
        }
        if (files_ == 0) {
            nothing_written();
        }
        return 0;
    }

private:
    struct Flight {
        FlightMemory memory;  ///< the newest rows
        FlightTrigger trigger;  ///< the event whose time is not over
        FlightBacklog backlog;  ///< events that are not written yet
    };

    /// Keeps what the machine has sent, and begins an event at a fault, at the trigger, and when the
    /// machine was killed.
    void accept(ProbeClient::Got got, Flight& flight) {
        switch (got) {
        case ProbeClient::Got::layout: flight.memory.layout(probe_.groups()); break;
        case ProbeClient::Got::journal:
            flight.memory.add(probe_.entry());
            if (probe_.entry().kind == "fault") {
                flight.trigger.event(probe_.entry().time_ns, "fault");
            }
            break;
        case ProbeClient::Got::batch: accept_batch(flight); break;
        case ProbeClient::Got::disconnected:
            if (client_.instance_end() == InstanceEnd::killed) {
                flight.trigger.event(now_ns_, "end-of-machine");
            }
            break;
        default: break;
        }
    }
    void accept_batch(Flight& flight) {
        now_ns_ = batch_.until_ns;
        if (first_ns_ == 0) {
            first_ns_ = now_ns_;
        }
        if (const auto time_ns = triggered()) {
            flight.trigger.event(*time_ns, what_.trigger);
        }
        flight.memory.add(std::move(batch_));
        const std::int64_t event_ns =
            flight.trigger.pending() ? flight.trigger.begin_ns() : INT64_MAX;
        flight.memory.prune(now_ns_, std::min(flight.backlog.needed_from_ns(), event_ns));
    }
    /// Passes an event on to the backlog once its time is over; `over`: the recording ends.
    void end_event(bool over, Flight& flight) {
        FlightTrigger& trigger = flight.trigger;
        if (!trigger.pending() || (!over && now_ns_ < trigger.end_ns())) return;
        flight.backlog.add({trigger.begin_ns(), trigger.begin_ns() + what_.last_ns,
                            trigger.end_ns(), trigger.cause(), ""});
        trigger.done();
    }

    ProbeClient::Got next() {
        constexpr int look_ms = 100;  // for Ctrl-C
        return probe_.next(batch_, look_ms);
    }

    std::string file_name() const {
        if (what_.rotate_ns < 0) return what_.file;
        const std::size_t dot = what_.file.rfind('.');
        return fmt::format("{}-{:03}{}", what_.file.substr(0, dot), files_ + 1,
                           what_.file.substr(dot));
    }

    bool open(const std::string& path) {
        path_ = path;
        rows_ = 0;
        ++files_;
        sink_ = make_sink(path, probe_.columns(), origin_);
        if (sink_->error() == 0) {
            print(kept_line(*sink_, path));
        }
        if (sink_->error() == 0 && sink_->layout(probe_.groups())) return true;
        cannot_write();
        return false;
    }

    bool add() {
        if (begin_ns_ < 0) {
            begin_ns_ = first_time();
        }
        const std::int64_t end_ns =
            what_.for_ns < 0 || begin_ns_ < 0 ? INT64_MAX : begin_ns_ + what_.for_ns;
        if (!add_batch(*sink_, batch_, 0, end_ns, rows_)) return false;
        ended_ = begin_ns_ >= 0 && batch_.until_ns >= end_ns;
        if (what_.max_mb > 0 && static_cast<double>(sink_->bytes()) >= what_.max_mb * 1e6) {
            ended_ = true;
        }
        if (what_.rotate_ns < 0 || begin_ns_ < 0 || ended_ ||
            batch_.until_ns - begin_ns_ < what_.rotate_ns * files_) {
            return true;
        }
        if (!complete()) return false;
        return open(file_name());
    }

    void nothing_written() {
        std::string trigger;
        if (!what_.trigger.empty()) {
            trigger = fmt::format(
                ", and '{}' {}", what_.trigger,
                was_on_ ? "was TRUE or non-zero all the time" : "did not become TRUE or non-zero");
        }
        print(fmt::format("nothing was written: there was no fault{}\n", trigger));
    }

    std::int64_t first_time() const {
        std::int64_t first = -1;
        for (const auto& part : batch_.parts) {
            if (part.rows != 0 && (first < 0 || batch_.time_ns(part, 0) < first)) {
                first = batch_.time_ns(part, 0);
            }
        }
        return first;
    }

    bool complete() {
        if (!sink_->close()) return false;
        written_.push_back(path_);
        print(
            fmt::format("{}: {} of {}, {}{}\n", path_, counted(rows_, "row"),
                        counted(probe_.columns().size(), "value"), file_size(sink_->bytes()),
                        probe_.lost() == 0 ? "" : ", " + counted(probe_.lost(), "row") + " lost"));
        // files of this run only; of a flight recorder the first is kept, because it is often the
        // cause of those after it
        const std::size_t first = what_.last_ns >= 0 ? 1 : 0;
        while (what_.keep != 0 && written_.size() > std::max<std::size_t>(what_.keep, 1 + first)) {
            std::remove(written_[first].c_str());
            written_.erase(written_.begin() + static_cast<std::ptrdiff_t>(first));
        }
        return true;
    }

    int finish() { return complete() ? 0 : cannot_write(); }

    int lost_machine() {
        const int status = finish();
        if (status != 0) return status;
        const InstanceEnd end = client_.instance_end();
        if (end == InstanceEnd::killed) {
            return fail(options_,
                        fmt::format("instance '{}' was killed; the file is complete up to there",
                                    client_.instance()));
        }
        if (end == InstanceEnd::running) {
            return fail(options_, fmt::format("instance '{}' closed the connection, and runs on; "
                                              "the file is complete up to there",
                                              client_.instance()));
        }
        return what_.for_ns < 0
                   ? 0
                   : fail(options_, fmt::format("instance '{}' has ended before the time was over",
                                                client_.instance()));
    }

    int cannot_write() { return fail(options_, tools::cannot_write(*sink_, path_)); }

    /// The time of the first row in which the trigger has become non-zero.
    std::optional<std::int64_t> triggered() {
        if (what_.trigger.empty()) return std::nullopt;
        std::optional<std::int64_t> at;
        batch_.in_time_order([&](const ProbeBatch::Part& part, std::size_t row) {
            if (part.group >= probe_.groups().size()) return;
            const auto& columns = probe_.groups()[part.group].columns;
            for (std::size_t c = 0; c < columns.size() && c < part.columns; ++c) {
                const ProbeColumn& column = probe_.columns()[columns[c]];
                if (column.name != what_.trigger) continue;
                const bool on = batch_.real(part, row, c, column.type) != 0;
                if (on && !was_on_ && !at) {
                    at = batch_.time_ns(part, row);
                }
                was_on_ = on;
            }
        });
        return at;
    }

    /// Writes the events of the backlog, the oldest first, until one cannot be written. The first
    /// failure is reported, and the end of them.
    void write(const FlightMemory& memory, FlightBacklog& backlog) {
        while (!backlog.empty()) {
            if (!write(memory, backlog.oldest())) {
                failure_ = tools::cannot_write(*sink_, path_);
                if (backlog.failed(monotonic_ns())) {
                    fail(options_, failure_ +
                                       "; the recorder goes on, and writes events from memory when "
                                       "there is space");
                }
                return;
            }
            backlog.written();
        }
        print(backlog.recovered());
    }
    bool write(const FlightMemory& memory, FlightEvent& event) {
        if (event.path.empty()) {
            do {
                event.path =
                    flight_name(what_.file, probe_.unix_ns(event.time_ns), event.cause, ++files_);
            } while (std::filesystem::exists(event.path));  // of another recorder
        }
        path_ = event.path;
        rows_ = 0;
        Origin origin = origin_;
        origin.cause = event.cause;
        sink_ = make_sink(path_, probe_.columns(), origin);
        return sink_->error() == 0 && memory.write(*sink_, event.begin_ns, event.end_ns, rows_) &&
               complete();
    }

    const Options& options_;
    const Recording& what_;
    Client& client_;
    ProbeClient& probe_;
    const Origin origin_;
    StopRequest stop_;
    ProbeBatch batch_;
    std::unique_ptr<Sink> sink_;
    std::string path_, failure_;  // the file being written; why the last one could not be
    std::vector<std::string> written_;
    std::uint64_t rows_ = 0;
    unsigned files_ = 0;
    std::int64_t begin_ns_ = -1;
    std::int64_t now_ns_ = 0;
    std::int64_t first_ns_ = 0;
    bool ended_ = false;
    bool was_on_ = true;
};

/// Returns what is wrong with the options of a recording, "" when nothing is.
std::string problem_of(const Recording& what) {
    if (!what.file.ends_with(".mcap") && !what.file.ends_with(".csv")) {
        return fmt::format("unknown format of '{}'; name the file .mcap or .csv", what.file);
    }
    std::string problem = unsupported_profile(what.profile, what.file);
    if (!problem.empty()) return problem;
    const bool last = what.last_ns >= 0;
    const bool rotate = what.rotate_ns >= 0;
    const struct {
        bool applies;
        const char* problem;
    } rules[] = {
        {what.names.empty() && what.groups.empty() && !what.all,
         "missing names of values; or --group NAME; or --all"},
        {what.all && !what.groups.empty(), "--all has every --group; leave one out"},
        {last && rotate, "--last and --rotate exclude each other; leave one out"},
        {!last && what.after_ns >= 0, "--after needs --last TIME"},
        {!last && !rotate && what.keep != 0, "--keep needs --rotate TIME or --last TIME"},
        {!last && !what.trigger.empty(),
         "--trigger needs --last TIME: what is kept until it comes"},
    };
    const auto* const broken =
        std::ranges::find_if(rules, [](const auto& rule) { return rule.applies; });
    return broken != std::end(rules) ? broken->problem : "";
}

void add_new(std::vector<std::string>& names, std::vector<std::string> more) {
    for (std::string& name : more) {
        if (std::ranges::find(names, name) == names.end()) {
            names.push_back(std::move(name));
        }
    }
}

/// Returns the names of all values to record; sets `problem` when one is unknown.
std::vector<std::string> names_of(Client& client, const Recording& what, std::string& problem) {
    std::vector<std::string> given = what.names;
    if (!what.trigger.empty()) {
        given.push_back(what.trigger);
    }
    std::vector<std::string> names = probed_names(client, given, problem);
    if (!problem.empty()) return names;
    if (what.all) {
        add_new(names, all_names(client));
    }
    for (const std::string& group : what.groups) {
        add_new(names, group_names(client, group, problem));
        if (!problem.empty()) return names;
    }
    if (names.size() > Probes::max_names) {
        problem = fmt::format("{} values are more than {}; name fewer, or type --group NAME",
                              names.size(), Probes::max_names);
    }
    return names;
}

/// Attaches a probe; for thousands of values with a shorter buffer, so that the disk may be late
/// for a shorter time only. Returns nullptr and sets `problem` to the reason.
std::unique_ptr<ProbeClient> attach(Client& client, const std::vector<std::string>& names,
                                    const Recording& what, std::string& problem) {
    constexpr auto min_buffer_ms = 100;
    ProbeClient::Options wanted;
    wanted.every = what.every;
    wanted.journal = true;
    for (;; wanted.buffer_ms /= 2) {
        auto probe = ProbeClient::attach(client, names, wanted, problem);
        if (probe) return probe;
        const std::size_t advice = problem.find("; sample fewer values");
        if (advice == std::string::npos) return nullptr;
        if (wanted.buffer_ms > min_buffer_ms) continue;
        // hal record has no buffer_ms
        problem = problem.substr(0, advice) + "; name fewer values, or type a larger --every";
        return nullptr;
    }
}

}  // namespace

int record_values(const Options& options, const std::string& instance, Recording what) {
    std::string problem = problem_of(what);
    if (!problem.empty()) return fail(options, problem);
    constexpr std::int64_t default_after_ns = 5'000'000'000;
    if (what.after_ns < 0) {
        what.after_ns = default_after_ns;
    }
    const auto client = Client::connect(instance, problem);
    if (!client) return fail(options, problem);
    const std::vector<std::string> names = names_of(*client, what, problem);
    if (!problem.empty()) return fail(options, problem);
    const auto probe = attach(*client, names, what, problem);
    if (!probe) return fail(options, problem);
    if (!what.trigger.empty()) {
        what.names.push_back(what.trigger);
    }
    Recorder recorder(options, what, *client, *probe);
    return what.last_ns >= 0 ? recorder.flight() : recorder.to_files();
}

}  // namespace hal::tools
