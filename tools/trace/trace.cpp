// SPDX-License-Identifier: MIT
// `hal trace FILE`: a timeline of what the threads of a running instance ran, for ui.perfetto.dev.
#include "trace/trace.hpp"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <ctime>
#include <deque>
#include <fcntl.h>
#include <fmt/core.h>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <poll.h>
#include <unistd.h>

#include "cli/output.hpp"
#include "cli/signals.hpp"
#include "control/client.hpp"
#include "machine/processes/address.hpp"
#include "text/numbers.hpp"
#include "text/quoting.hpp"
#include "trace/perfetto.hpp"
#include "trace/sched.hpp"

namespace hal::tools {

namespace {

using nlohmann::json;
using Clock = std::chrono::steady_clock;
constexpr std::int64_t default_keep_ns = 5'000'000'000;
constexpr std::int64_t default_after_ns = 200'000'000;
constexpr auto times_period = std::chrono::milliseconds(100);
constexpr std::size_t max_kept_bytes = std::size_t{512} << 20;

std::int64_t now_ns(clockid_t clock) {
    timespec now{};
    ::clock_gettime(clock, &now);
    return now.tv_sec * 1'000'000'000 + now.tv_nsec;
}

/// What one look at the instance brought, before it is encoded: the ring keeps these.
struct Chunk {
    struct Part {
        TraceThread thread;
        std::vector<ThreadEvent> events;
        std::uint64_t lost = 0;
    };
    struct Entry {
        std::int64_t time_ns;
        std::string kind, text;
    };
    std::int64_t time_ns = 0;  ///< when it came
    std::vector<Part> parts;
    std::vector<Entry> entries;
    std::vector<Switch> switches;
    std::vector<std::pair<TraceThread, ThreadTimes>> times;

    std::size_t bytes() const {
        std::size_t bytes = sizeof(Chunk) + switches.size() * sizeof(Switch);
        for (const Part& part : parts) {
            bytes += part.events.size() * sizeof(ThreadEvent);
        }
        return bytes;
    }
};

/// What is printed at the end.
struct Summary {
    std::uint64_t cycles = 0;
    std::uint64_t calls = 0;
    std::uint64_t lost = 0;
    std::uint64_t overruns = 0;
    std::int64_t max_ns = -1;  ///< from the due time of a cycle to its end
    std::string thread, function;
    std::uint64_t cycle = 0;
    std::int64_t latency_ns = 0;
    std::int64_t execution_ns = 0;
    std::int64_t function_ns = 0;
    std::map<int, ThreadEvent> slowest;  ///< function of the cycle that is not over yet, by tid

    void add(const TraceThread& from, const ThreadEvent& event,
             const std::map<std::uint32_t, std::string>& names) {
        if (event.kind == ThreadEvent::function) {
            ++calls;
            const auto [at, fresh] = slowest.emplace(from.tid, event);
            if (!fresh && event.end_ns - event.begin_ns > at->second.end_ns - at->second.begin_ns) {
                at->second = event;
            }
        }
        if (event.kind != ThreadEvent::cycle) return;
        ++cycles;
        const std::int64_t took_ns = event.end_ns - event.begin_ns;
        const std::int64_t late_ns = took_ns + event.id;
        overruns += late_ns > from.period_ns;
        if (late_ns > max_ns) {
            max_ns = late_ns;
            thread = from.name;
            cycle = event.cycle_number;
            latency_ns = event.id;
            execution_ns = took_ns;
            function.clear();
            if (const auto at = slowest.find(from.tid); at != slowest.end()) {
                function_ns = at->second.end_ns - at->second.begin_ns;
                if (const auto named = names.find(at->second.id); named != names.end()) {
                    function = named->second;
                }
            }
        }
        slowest.erase(from.tid);
    }
};

class Tracer {
public:
    explicit Tracer(const TraceOptions& options) : options_(options) {}
    ~Tracer() {
        if (file_ >= 0) {
            ::close(file_);
        }
    }
    Tracer(const Tracer&) = delete;
    int run();

private:
    bool ring() const { return options_.on_overrun || options_.on_fault; }
    bool attach();
    void receive(int timeout_ms);
    void take(const json& event, const std::string& payload, Chunk& chunk);
    void keep(Chunk chunk);
    void write(const std::string& bytes) {
        if (error_ != 0) return;
        if (write_all(file_, bytes)) {
            written_ += bytes.size();
        } else {
            error_ = errno;
        }
    }
    void write(const Chunk& chunk);
    bool open();
    void begin_file();
    int finish();
    /// Makes the end of a machine that was killed the event of a ring; else prints why it has ended
    /// too early. Returns the status of the command.
    int note_end_of_machine();
    void print_summary() const;
    int fail_to_write();
    std::string ending(InstanceEnd end) const;
    bool remove_if_empty();

    const TraceOptions& options_;
    StopRequest stop_;
    std::unique_ptr<Client> client_;
    SchedulerEvents scheduler_;
    PerfettoWriter writer_;
    std::map<std::uint32_t, std::string> names_;
    std::map<int, TraceThread> threads_;
    std::deque<Chunk> kept_;
    Summary summary_;
    Clock::time_point next_times_ = Clock::now();
    std::int64_t fired_ns_ = 0;  ///< when the overrun or fault came; 0: not yet
    std::string cause_;
    int file_ = -1;
    bool fresh_ = false;  ///< there was no file of this name
    std::size_t written_ = 0;  ///< bytes of whole packets in the file
    int error_ = 0;  ///< of the first write that failed
    std::size_t kept_bytes_ = 0;
};

bool Tracer::attach() {
    std::string problem;
    client_ = Client::connect(instance_wanted(options_.name), problem);
    if (!client_) return fail(options_, problem) == 0;
    const json reply = client_->request({{"trace", true}});
    if (!reply.value("ok", false)) return fail(options_, reply.value("error", "no answer")) == 0;
    client_->request({{"journal", true}});
    if (!options_.sched) return true;
    if (const std::string why = scheduler_.open(); !why.empty()) {
        fail(options_,
             fmt::format(
                 "no scheduler events: {}; the trace has the waiting times of the threads instead",
                 why));
    }
    return true;
}

void Tracer::take(const json& event, const std::string& payload, Chunk& chunk) {
    const json names = event.value("names", json::object());
    for (const auto& [id, name] : names.items()) {
        const auto number = parse_natural(id);
        if (!number || !name.is_string()) continue;
        names_[static_cast<std::uint32_t>(*number)] = name.get<std::string>();
        writer_.name(static_cast<std::uint32_t>(*number), name.get<std::string>());
    }
    std::size_t at = 0;
    for (const json& part : event.value("parts", json::array())) {
        Chunk::Part one;
        one.thread = {part.value("thread", ""), part.value("period_ns", std::int64_t{0}),
                      part.value("tid", 0)};
        one.lost = part.value("lost", std::uint64_t{0});
        const auto count = part.value("count", std::size_t{0});
        if (count > (payload.size() - at) / sizeof(ThreadEvent)) return;
        one.events.resize(count);
        std::memcpy(one.events.data(), payload.data() + at, count * sizeof(ThreadEvent));
        at += count * sizeof(ThreadEvent);
        threads_[one.thread.tid] = one.thread;
        summary_.lost += one.lost;
        for (const ThreadEvent& each : one.events) {
            summary_.add(one.thread, each, names_);
            const std::int64_t late_ns = each.end_ns - each.begin_ns + each.id;
            if (options_.on_overrun && fired_ns_ == 0 && each.kind == ThreadEvent::cycle &&
                late_ns > one.thread.period_ns) {
                fired_ns_ = each.end_ns;
                cause_ = fmt::format("cycle {} of '{}' ended {} after it was due (period {})",
                                     each.cycle_number, one.thread.name,
                                     format_duration(static_cast<double>(late_ns)),
                                     format_duration(static_cast<double>(one.thread.period_ns)));
            }
        }
        chunk.parts.push_back(std::move(one));
    }
}

void Tracer::receive(int timeout_ms) {
    Chunk chunk;
    json event;
    std::string payload;
    while (client_->next_event(event, payload, timeout_ms)) {
        timeout_ms = 0;
        const std::string kind = event.value("event", "");
        if (kind == "trace") {
            take(event, payload, chunk);
        }
        if (kind != "journal") continue;
        chunk.entries.push_back({event.value("time_ns", std::int64_t{0}), event.value("kind", ""),
                                 event.value("text", "")});
        if (options_.on_fault && fired_ns_ == 0 && chunk.entries.back().kind == "fault") {
            fired_ns_ = chunk.entries.back().time_ns;
            cause_ = chunk.entries.back().text;
        }
    }
    chunk.switches = scheduler_.take();
    if (Clock::now() >= next_times_) {
        next_times_ = Clock::now() + times_period;
        for (const auto& [tid, thread] : threads_) {
            if (const auto times = thread_times(client_->pid(), tid)) {
                chunk.times.emplace_back(thread, *times);
            }
        }
    }
    chunk.time_ns = now_ns(CLOCK_MONOTONIC);
    if (chunk.parts.empty() && chunk.entries.empty() && chunk.switches.empty() &&
        chunk.times.empty()) {
        return;
    }
    if (ring()) {
        keep(std::move(chunk));
    } else {
        write(chunk);
    }
}

void Tracer::keep(Chunk chunk) {
    kept_bytes_ += chunk.bytes();
    kept_.push_back(std::move(chunk));
    const std::int64_t keep_ns = options_.keep_ns >= 0 ? options_.keep_ns : default_keep_ns;
    while ((fired_ns_ == 0 && kept_.front().time_ns < kept_.back().time_ns - keep_ns) ||
           kept_bytes_ > max_kept_bytes) {
        kept_bytes_ -= kept_.front().bytes();
        kept_.pop_front();
    }
}

void Tracer::write(const Chunk& chunk) {
    std::string bytes;
    for (const Chunk::Part& part : chunk.parts) {
        bytes += writer_.events(part.thread, part.events, part.lost);
    }
    for (const Chunk::Entry& entry : chunk.entries) {
        bytes += writer_.instant(entry.time_ns, entry.kind, entry.text);
    }
    for (const auto& [thread, times] : chunk.times) {
        bytes += writer_.counter(thread, "run time", chunk.time_ns, times.ran_ns);
        bytes += writer_.counter(thread, "waited for a CPU", chunk.time_ns, times.waited_ns);
    }
    bytes += PerfettoWriter::switches(chunk.switches);
    write(bytes);
}

/// Opens the file before anything is traced: what cannot be written is known then, not after the
/// fault. An old one is replaced later.
bool Tracer::open() {
    const std::string& path = options_.words.front();
    fresh_ = ::access(path.c_str(), F_OK) != 0;
    file_ = ::open(path.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0644);
    return file_ >= 0 ||
           fail(options_, fmt::format("cannot write '{}': {}", path, std::strerror(errno))) == 0;
}

void Tracer::begin_file() {
    if (::ftruncate(file_, 0) != 0 && errno != EINVAL) {
        error_ = errno;  // EINVAL: a pipe
    }
    write(writer_.begin(client_->instance(), client_->pid(),
                        {now_ns(CLOCK_MONOTONIC), now_ns(CLOCK_REALTIME), now_ns(CLOCK_BOOTTIME)}));
}

bool Tracer::remove_if_empty() {
    return written_ == 0 && fresh_ && ::unlink(options_.words.front().c_str()) == 0;
}

/// What is in the file ends with a whole packet then.
int Tracer::fail_to_write() {
    const bool cut = ::ftruncate(file_, static_cast<off_t>(written_)) == 0;
    const char* content = cut ? "the file is complete up to there" : "its last packet is damaged";
    if (remove_if_empty()) {
        content = "nothing was written";
    } else if (written_ == 0) {
        content = "the file is empty";
    }
    return fail(options_, fmt::format("cannot write '{}': {}; {}", options_.words.front(),
                                      std::strerror(error_), content));
}

/// How the connection to the machine ended, as a sentence.
std::string Tracer::ending(InstanceEnd end) const {
    const std::string who = fmt::format("instance '{}'", client_->instance());
    const std::string& why = client_->closed_because();
    if (!why.empty()) return fmt::format("{} closed the connection: {}", who, why);
    switch (end) {
    case InstanceEnd::killed: return who + " was killed";
    case InstanceEnd::running: return who + " closed the connection, and runs on";
    default: return who + " has ended";
    }
}

/// Writes what a ring has kept, and prints the summary and why the trace has ended. Returns the
/// status of the command.
int Tracer::finish() {
    const int status = client_->connected() ? 0 : note_end_of_machine();
    if (ring() && fired_ns_ == 0) {
        remove_if_empty();
        const char* what = options_.on_overrun ? "overrun" : "fault";
        if (options_.on_overrun && options_.on_fault) {
            what = "overrun or fault";
        }
        print(fmt::format("no {} in {}; nothing was written\n", what,
                          counted(summary_.cycles, "cycle")));
        return status;
    }
    if (ring()) {
        begin_file();
        for (const Chunk& chunk : kept_) {
            write(chunk);
        }
    }
    if (error_ != 0) return fail_to_write();
    print_summary();
    return status;
}

int Tracer::note_end_of_machine() {
    const InstanceEnd end = client_->instance_end();
    const bool killed = end == InstanceEnd::killed;
    const std::string ended = ending(end);
    if (ring() && fired_ns_ == 0 && killed) {
        fired_ns_ = now_ns(CLOCK_MONOTONIC);
        cause_ = ended;
        return 0;
    }
    if (options_.for_ns >= 0) return fail(options_, ended + " before the time was over");
    const bool runs = end == InstanceEnd::running;
    return killed || runs || !client_->closed_because().empty() ? fail(options_, ended) : 0;
}

void Tracer::print_summary() const {
    if (!cause_.empty()) {
        print(cause_ + "\n");
    }
    print(fmt::format("wrote {}: {}, {}, {}, {} lost; open it in https://ui.perfetto.dev\n",
                      options_.words.front(), counted(summary_.cycles, "cycle"),
                      counted(summary_.calls, "function call"),
                      counted(summary_.overruns, "overrun"), counted(summary_.lost, "event")));
    if (summary_.max_ns < 0) return;
    std::string line = fmt::format(
        "latest end: cycle {} of '{}', {} after it was due: wake-up latency {}, execution {}",
        summary_.cycle, summary_.thread, format_duration(static_cast<double>(summary_.max_ns)),
        format_duration(static_cast<double>(summary_.latency_ns)),
        format_duration(static_cast<double>(summary_.execution_ns)));
    if (!summary_.function.empty()) {
        line += fmt::format(", of it {} in {}",
                            format_duration(static_cast<double>(summary_.function_ns)),
                            summary_.function);
    }
    print(line + "\n");
}

int Tracer::run() {
    if (options_.words.size() != 1) {
        return fail(options_, fmt::format("unexpected argument '{}'; type: hal trace {}",
                                          options_.words[1], options_.words[0]));
    }
    if (!ring() && (options_.keep_ns >= 0 || options_.after_ns >= 0)) {
        return fail(options_, fmt::format("{} needs --on-overrun or --on-fault",
                                          options_.keep_ns >= 0 ? "--keep" : "--after"));
    }
    if (options_.for_ns == 0) return fail(options_, "--for 0 traces nothing; use a time like 10s");
    if (!attach()) return 1;
    if (!open()) return 1;
    if (!ring()) {
        begin_file();
    }
    const auto end = options_.for_ns >= 0 ? Clock::now() + std::chrono::nanoseconds(options_.for_ns)
                                          : Clock::time_point::max();
    while (!stop_.requested() && error_ == 0 && Clock::now() < end && client_->connected()) {
        pollfd waiting[] = {{client_->fd(), POLLIN, 0}, {stop_.fd(), POLLIN, 0}};
        ::poll(waiting, 2, 20);
        receive(0);
        if (fired_ns_ != 0 &&
            now_ns(CLOCK_MONOTONIC) >
                fired_ns_ + (options_.after_ns >= 0 ? options_.after_ns : default_after_ns)) {
            break;
        }
    }
    if (client_->connected()) {
        client_->request({{"trace", false}});
        receive(0);
    }
    return finish();
}

}  // namespace

int run_trace(const TraceOptions& options) { return Tracer(options).run(); }

}  // namespace hal::tools
