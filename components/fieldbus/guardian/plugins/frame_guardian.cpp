// SPDX-License-Identifier: MIT
#include <algorithm>
#include <atomic>
#include <cstdio>
#include <iterator>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <string>
#include <string_view>

#include "bus/guardian/program_path.hpp"
#include "bus/guardian/report.hpp"
#include "bus/guardian/report_lock.hpp"
#include "fieldbus/guardian/guardian_process.hpp"
#include "fieldbus/guardian/stop_events.hpp"
#include "hal/background.hpp"
#include "hal/component.hpp"
#include "hal/lasting_fault.hpp"
#include "hal/naming.hpp"
#include "hal/reporter.hpp"
#include "hal/setup_time.hpp"
#include "link/call_journal.hpp"

namespace {

using namespace hal::guardian;

constexpr std::int64_t millisecond = 1'000'000;
constexpr std::int64_t turn_ns = 20 * millisecond;    // of the background thread
constexpr std::int64_t stall_ns = 500 * millisecond;  // of the guardian, whose turns take 5 ms
constexpr std::int64_t stuck_ns = 1500 * millisecond;
constexpr std::int64_t replace_ns = 1000 * millisecond;  // between two attempts

struct EventRecord {
    Event event = Event::stopping;
    StopRecord stop{};
};

/// What a cycle shows.
struct View {
    bool is_alive = true;   // the guardian, if there is one
    bool stalls = false;
    Status status;

    std::uint64_t word() const noexcept {
        return std::uint64_t{status.word()} << 2 | std::uint64_t{stalls} << 1 |
               std::uint64_t{is_alive};
    }
    static View of(std::uint64_t word) noexcept {
        return {(word & 1) != 0, (word & 2) != 0,
                Status::of(static_cast<std::uint32_t>(word >> 2))};
    }
};

struct FrameGuardian : hal::Component {
    explicit FrameGuardian(const hal_host* host)
        : Component(host), name_(hal::own_name("frame-guardian.0")) {
        if (frames_.get().empty()) return;
        std::string problem = parse(frames_.get(), "", parsed_);
        if (!problem.empty()) throw hal::ArgumentError("send", "send: " + problem);
        problem = parse(frames_.get(), confirmations_.get(), parsed_ = {});
        if (!problem.empty()) throw hal::ArgumentError("confirm", "confirm: " + problem);
        check_duration();
        check_link();
    }

    void start() {
        if (parsed_.size() == 0) {
            throw std::runtime_error(
                "missing frames; write send=\"ID#DATA,...\", as in send=\"201#0000\"");
        }
        const auto* host = hal::extension<hal_background>(HAL_BACKGROUND);
        is_virtual_ = host != nullptr && host->is_virtual != 0;
        replays_ = hal::link::journal_mode() == hal::link::JournalMode::executes_again;
        faults_ = hal::extension<hal_faults>("hal.faults/1");
        setup_time_.start();
        has_guardian_ = !is_in_memory();
        if (!has_guardian_) {
            start_local();
        } else if (is_virtual_ && !replays_) {
            throw std::runtime_error("'" + link_.get() +
                                     "' is a real link, and a simulation sends nothing on it; "
                                     "write link=sim:NAME, or use hal run");
        } else if (replays_) {
            const hal::link::OpeningLink link;
        } else {
            start_guardian();
        }
        shown_ = {};
        told_stall_ = false;
        told_ready_ = true;
        silent_ns_ = 0;
        acknowledged_stop_ = 0;
        reporter_.start();
        background_.start();
    }

    void stop() noexcept {
        background_.stop();
        if (local_) {
            setup_time_.expect(local_->closing_ns(), hal::can::closing_text);
            own_memory_.requests.request(StopReason::unload);
            work_local(local_ns_);
            report_outcome();
            local_.reset();
        }
        end_guardian();
        reporter_.stop();
    }

    void update(hal::Cycle cycle) noexcept {
        GuardianMemory& memory = this->memory();
        follow_estop(memory);
        const std::int64_t limit_ns =
            std::max<std::int64_t>(heartbeat_ms_ * millisecond, 3 * cycle.period_ns());
        memory.cycles.count(limit_ns);
        if (is_interrupted_.exchange(false, std::memory_order_acquire)) {
            memory.requests.release(StopReason::fault);  // behind the count: CycleCounter
        }
        safe_cycle_.store(0, std::memory_order_relaxed);
        std::uint64_t seen = look(cycle).word();
        hal::link::JournaledCall call;
        if (has_guardian_) {
            call.number(seen);
        }
        show(View::of(seen));
    }

    void make_safe(hal::Cycle cycle) noexcept {
        is_interrupted_.store(true, std::memory_order_release);
        GuardianMemory& memory = this->memory();
        const bool is_new = memory.requests.hold(StopReason::fault);
        // a thread that was started again, and had commanded the devices before it came to update()
        const std::uint64_t number = cycle.number();
        const bool has_run = number > safe_cycle_.exchange(number, std::memory_order_relaxed);
        if (is_new || has_run) {
            memory.requests.request(StopReason::fault);
        }
        if (local_) {
            work_local(cycle.start_ns());
        }
    }

private:
    /// Of the guardian; without one, of the component.
    GuardianMemory& memory() noexcept { return guardian_ ? guardian_->memory() : own_memory_; }

    void check_duration() const {
        const std::int64_t duration_ms = repeat_ * every_ms_;
        constexpr std::int64_t max_ms = max_duration_ns / millisecond;
        if (duration_ms <= max_ms) return;
        throw hal::ArgumentError(
            "repeat",
            "repeat=" + std::to_string(repeat_) + " every_ms=" + std::to_string(every_ms_) +
                " takes " + std::to_string(duration_ms) + " ms, and a stop takes at most " +
                std::to_string(max_ms) + " ms; write repeat=" + std::to_string(max_ms / every_ms_) +
                ", or a shorter every_ms=");
    }

    void check_link() const {
        if (!hal::can::describe(link_.get()).in_slots) return;
        throw hal::ArgumentError("link", "link: '" + link_.get() +
                                             "' is a node of this process, and the guardian is "
                                             "another one; write the address of the bus");
    }

    bool is_in_memory() const {
        if (!parsed_.ethernet.empty()) {
            return hal::ethernet::describe(link_.get()).transport == "segment in memory";
        }
        return hal::can::describe(link_.get()).in_memory;
    }

    StopSchedule schedule() const noexcept {
        return {.rounds = static_cast<std::uint32_t>(repeat_), .every_ns = every_ms_ * millisecond};
    }

    // --- Without a guardian: on a bus in memory

    void start_local() {
        local_ = std::make_unique<StopTransmitter>(parsed_, schedule());
        const std::string problem = local_->open(link_.get());
        if (!problem.empty()) throw std::runtime_error(problem);
        own_stop_ = {};
        own_memory_.requests.release(StopReason::fault);
        own_memory_.requests.release(StopReason::estop);
        stop_count_ = own_memory_.requests.newest().count;
        was_estop_ = false;
    }

    /// What a guardian does in its turns. [realtime]
    void work_local(std::int64_t now) noexcept {
        local_ns_ = now;
        Status& status = own_stop_.status;
        const hal::bus::StopRequests::Request request = own_memory_.requests.newest();
        if (request.count != stop_count_) {
            stop_count_ = request.count;
            own_stop_.begin(request.reason);
            ++status.stops;
            status.phase = Phase::stopping;
            local_->begin(now);
        }
        local_->work(now);
        if (status.phase == Phase::stopping && local_->is_over()) {
            status.phase = Phase::stopped;
        }
        if (status.phase == Phase::stopped && !own_memory_.requests.holds_any()) {
            status.phase = Phase::watching;
        }
        status.outcome = local_->outcome();
        status.failure = local_->failure();
        status.is_ready = local_->is_ready();
        status.sees_bus = local_->sees_bus();
        own_stop_.rounds = local_->rounds_sent();
        own_stop_.elapsed_ns = local_->elapsed_ns();
        own_stop_.unsent = local_->unsent();
        own_memory_.record.write(own_stop_);
    }

    // --- With a guardian

    static std::string program() {
        return hal::bus::guardian_program(
            reinterpret_cast<const void*>(
                static_cast<hal::can::Description (*)(std::string_view)>(&hal::can::describe)),
            "hal-frame-guardian");
    }

    void start_guardian() {
        // the values of a guardian are inputs from outside
        const hal::link::OpeningLink link;
        guardian_.reset();  // of a start that has failed behind it
        lock_.release();
        const std::string report = hal::bus::report_file("frames-" + link_.get() + "-" + name_);
        std::string problem = lock_.acquire(report, link_.get());
        if (!problem.empty()) throw std::runtime_error(problem);
        guardian_ = std::make_unique<GuardianProcess>(
            GuardianArguments{.program = program(),
                              .name = name_,
                              .link = link_.get(),
                              .frames = frames_.get(),
                              .confirmations = confirmations_.get(),
                              .schedule = schedule(),
                              .report = report,
                              .lock = lock_.descriptor()});
        problem = guardian_->start();
        if (!problem.empty()) {
            guardian_.reset();
            lock_.release();
            throw std::runtime_error(problem);
        }
        is_alive_.store(true);
        stalls_.store(false);
        was_estop_ = false;
        turned_ns_ = hal::link::monotonic_ns();
        previous_report_ = hal::bus::take_report(report);  // now that nothing prevents its print
        if (!previous_report_.empty()) {
            reporter_.tell({Event::previous_stop});
        }
    }

    void end_guardian() noexcept {
        if (!guardian_) return;
        const std::int64_t limit = unload_ns + schedule().duration_ns() + 1000 * millisecond;
        constexpr std::int64_t start_ns = 3000 * millisecond;
        setup_time_.expect(2 * limit + start_ns, "the guardian still sends the stop frames");
        bool has_ended = is_alive_.load() && guardian_->end(limit);
        if (!has_ended) {
            if (is_alive_.load()) {
                reporter_.tell({Event::guardian_killed});
            }
            has_ended = replace() && guardian_->end(limit);
        }
        report_outcome();
        report_unsent(has_ended);
        guardian_.reset();
        lock_.release();
    }

    /// The guardian has ended by request, and nothing sends what it has not sent.
    void report_unsent(bool has_ended) noexcept {
        const StopRecord stop = memory().record.last();
        const Outcome outcome = stop.status.outcome;
        const bool is_sent =
            has_ended && outcome != Outcome::sending && outcome != Outcome::delayed;
        if (!is_sent) {
            reporter_.tell({.event = Event::not_sent, .stop = stop});
        }
        if (!is_sent || outcome == Outcome::unconfirmed) {
            const Event event = is_sent ? Event::unconfirmed : Event::delayed;
            outcome_fault_.begin(faults_, this, fault_texts_.of(event, 0)->text.c_str());
        }
    }

    /// Of the background thread: sees the end of the guardian and one that stalls, starts another
    /// one, and reports what it does, also while no cycle runs.
    void turn(std::int64_t, bool may_wait) noexcept {
        const std::int64_t pause_ns = may_wait ? turn_ns : 0;
        if (!guardian_) {
            sleep_for(pause_ns);
        } else if (!is_alive_.load(std::memory_order_relaxed)) {
            sleep_for(pause_ns);
            if (hal::link::monotonic_ns() >= replace_at_ns_) {
                replace();
            }
        } else if (guardian_->has_ended_within(pause_ns)) {
            is_alive_.store(false, std::memory_order_release);
            reporter_.tell({Event::guardian_lost});
            replace();
        } else {
            watch_turns();
        }
        report_outcome();
    }

    /// Only time in which this thread runs counts: where it does not, the guardian may stand as
    /// well.
    void watch_turns() noexcept {
        const std::int64_t now = hal::link::monotonic_ns();
        const std::int64_t elapsed = std::min(now - turned_ns_, 2 * turn_ns);
        turned_ns_ = now;
        const std::uint64_t turns = memory().turns.load(std::memory_order_relaxed);
        silent_ns_ = turns == turns_ ? silent_ns_ + elapsed : 0;
        turns_ = turns;
        const bool stalls = silent_ns_ > stall_ns;
        stalls_.store(stalls, std::memory_order_relaxed);
        if (stalls) {
            guardian_->resume();
        }
        if (silent_ns_ <= stuck_ns) return;
        is_alive_.store(false, std::memory_order_release);
        reporter_.tell({Event::guardian_stuck});
        replace();
    }

    /// Starts another guardian. Returns false when that has failed; it is tried again.
    bool replace() noexcept {
        std::string problem;
        try {
            problem = guardian_->replace();
        } catch (const std::exception& error) {
            problem = error.what();
        }
        silent_ns_ = 0;
        turned_ns_ = hal::link::monotonic_ns();
        stalls_.store(false, std::memory_order_relaxed);
        if (!problem.empty()) {
            replace_at_ns_ = turned_ns_ + replace_ns;
            {
                const std::lock_guard lock(problem_mutex_);
                problem_.swap(problem);
            }
            reporter_.tell({Event::guardian_missing});
            return false;
        }
        is_alive_.store(true, std::memory_order_release);
        told_stall_ = false;
        reporter_.tell({Event::guardian_replaced});
        return true;
    }

    static void sleep_for(std::int64_t ns) noexcept {
        if (ns == 0) return;
        const timespec pause = hal::link::to_timespec(ns);
        nanosleep(&pause, nullptr);
    }

    /// Reports what has changed since the last call; later, when it is being written now.
    void report_outcome() noexcept {
        StopRecord stop;
        if (!memory().record.read(stop)) return;
        const Status& now = stop.status;
        const auto tell = [&](Event event) { reporter_.tell({.event = event, .stop = stop}); };
        const bool is_new = now.stops != shown_.stops;
        if (is_new) {
            report_earlier(stop);
            tell(Event::stopping);
        }
        if (is_new || now.outcome != shown_.outcome) {
            switch (now.outcome) {
            case Outcome::sent: tell(Event::sent); break;
            case Outcome::confirmed: tell(Event::confirmed); break;
            case Outcome::unconfirmed: tell(Event::unconfirmed); break;
            case Outcome::delayed: tell(Event::delayed); break;
            default: break;
            }
        }
        if (now.is_ready != told_ready_ && !is_stopping(now)) {
            told_ready_ = now.is_ready;
            tell(now.is_ready ? Event::link_ready : Event::link_lost);
        }
        if (const bool stalls = stalls_.load(std::memory_order_relaxed); stalls != told_stall_) {
            told_stall_ = stalls;
            tell(stalls ? Event::guardian_stalls : Event::guardian_runs);
        }
        shown_ = now;
    }
    /// Reports stops that another one has followed since the last call.
    void report_earlier(const StopRecord& newest) noexcept {
        const auto begun = static_cast<std::uint16_t>(newest.status.stops - shown_.stops);
        const unsigned unreported = begun - 1U;
        for (unsigned n = std::min(unreported, StopRecord::max_earlier); n > 0; --n) {
            reporter_.tell({.event = Event::stopping, .stop = newest.before(n)});
        }
    }
    /// A stop that is tried again reports its link itself.
    static bool is_stopping(const Status& status) noexcept {
        return status.phase == Phase::stopping || status.phase == Phase::ended;
    }

    std::string line(const EventRecord& record) const {
        return hal::bus::format(event_rows[static_cast<std::size_t>(record.event)].text,
                                hal::bus::Text::line,
                                [&](std::string_view name) { return value_of(name, record); });
    }
    std::string value_of(std::string_view name, const EventRecord& record) const {
        const StopRecord& stop = record.stop;
        if (name == "link") return link_.get();
        if (name == "reason") return to_string(stop.reason);
        if (name == "sent") return sent_text(stop.status.sees_bus);
        if (name == "report") return previous_report_;
        if (name == "problem") {
            const std::lock_guard lock(problem_mutex_);
            return problem_;
        }
        std::string text;
        char number[48] = "";
        if (name == "unsent" && stop.status.failure == Failure::none) {
            text = "not as often as declared";
        } else if (name == "unsent") {
            append_unsent(text, parsed_, stop.unsent, stop.status.failure);
        } else if (name == "rounds") {
            std::snprintf(number, sizeof number, "%u time%s", stop.rounds,
                          stop.rounds == 1 ? "" : "s");
        } else if (name == "time") {
            std::snprintf(number, sizeof number, "%.1f ms",
                          static_cast<double>(stop.elapsed_ns) * 1e-6);
        }
        return text + number;
    }

    // --- Of the cycle

    void follow_estop(GuardianMemory& memory) noexcept {
        if (estop && !was_estop_) {
            memory.requests.hold(StopReason::estop);
            memory.requests.request(StopReason::estop);
        } else if (!estop && was_estop_) {
            memory.requests.release(StopReason::estop);
        }
        was_estop_ = estop;
    }

    View look(hal::Cycle cycle) noexcept {
        if (local_) {
            work_local(cycle.start_ns());
            return {.status = own_stop_.status};
        }
        if (!guardian_) return {};
        return {.is_alive = is_alive_.load(std::memory_order_acquire),
                .stalls = stalls_.load(std::memory_order_relaxed),
                .status = guardian_->memory().record.status()};
    }

    /// The outcome of a stop lasts until the next one, or until it is acknowledged.
    Outcome lasting_outcome(const Status& status) noexcept {
        if (acknowledge && !was_acknowledged_ && status.phase != Phase::stopping) {
            acknowledged_stop_ = status.stops;
        }
        was_acknowledged_ = acknowledge;
        return status.stops == acknowledged_stop_ ? Outcome::none : status.outcome;
    }

    void show(const View& view) noexcept {
        const Status& status = view.status;
        set(guardian_fault_, Event::guardian_lost, !view.is_alive);
        set(stall_fault_, Event::guardian_stalls, view.is_alive && view.stalls);
        const Outcome outcome = lasting_outcome(status);
        set(outcome_fault_, Event::unconfirmed, outcome == Outcome::unconfirmed);
        set(delay_fault_, Event::delayed, outcome == Outcome::delayed);
        set(link_fault_, Event::link_lost,
            !status.is_ready && outcome != Outcome::delayed && !is_stopping(status));
        const bool is_sent =
            status.outcome == Outcome::sent || status.outcome == Outcome::confirmed;
        guarded = has_guardian_ && view.is_alive && !view.stalls && status.is_ready;
        stopped = status.phase == Phase::stopped && is_sent;
        fault = guardian_fault_.lasts() || stall_fault_.lasts() || outcome_fault_.lasts() ||
                delay_fault_.lasts() || link_fault_.lasts();
        stops = status.stops;
    }

    void set(hal::LastingFault& condition, Event event, bool lasts) noexcept {
        if (lasts == condition.lasts()) return;
        if (!lasts) {
            condition.end(faults_, this);
        } else if (const auto* text = fault_texts_.of(event, 0)) {
            condition.begin(faults_, this, text->text.c_str());
        }
    }

    hal::TextArgument link_{*this,
                            "link",
                            "sim:can0",
                            "address of the bus or interface, as in can:can0, eth:eth0, sim:can0",
                            {.per_instance = true}};
    hal::TextArgument frames_{*this, "send", "000#0200",
                              "frames in their order: ID#DATA,... on CAN, whole frames in "
                              "hexadecimal digits on Ethernet"};
    hal::TextArgument confirmations_{*this, "confirm", "",
                                     "CAN frames that confirm the stop: ID#DATA,...; data of "
                                     "a received frame may be longer"};
    hal::Argument repeat_{*this,
                          "repeat",
                          3,
                          "how often all frames are sent; with confirm=: at most",
                          {.per_instance = true, .min = 1, .max = 1000}};
    hal::Argument every_ms_{*this,
                            "every_ms",
                            10,
                            "time from one round of frames to the next",
                            {.per_instance = true, .min = 1, .max = 1000}};
    hal::Argument heartbeat_ms_{*this,
                                "heartbeat_ms",
                                50,
                                "the frames are sent when no cycle has run for this time, and at "
                                "least for 3 periods of the thread",
                                {.per_instance = true, .min = 20, .max = 10000}};

    hal::Function update_{*this,
                          "update",
                          &FrameGuardian::update,
                          "counts cycles for the guardian, and shows what it does",
                          {.required = true}};
    hal::Emergency emergency_{*this, &FrameGuardian::make_safe, "sends the stop frames"};

    hal::In<bool> estop{*this, "estop",
                        "rising edge: the stop frames are sent; the reason lasts while it is TRUE"};
    hal::In<bool> acknowledge{*this, "acknowledge",
                              "rising edge: the fault of the last stop is over"};
    hal::Out<bool> guarded{*this,
                           "guarded",
                           "a guardian sends the stop frames when this process ends; FALSE on a "
                           "bus in memory, and while update does not run",
                           {.safe = false}};
    hal::Out<bool> stopped{*this,
                           "stopped",
                           "the stop frames have been sent, and confirmed if that is asked for; "
                           "the reason lasts; FALSE while update does not run",
                           {.safe = false}};
    hal::Out<bool> fault{*this, "fault",
                         "the guardian is lost or stalls, the link is down, or the stop frames are "
                         "not sent or not confirmed, until the next stop or `acknowledge`"};
    hal::Out<std::uint32_t> stops{*this, "stops", "stops begun, modulo 65536"};

    const std::string name_;
    StopFrames parsed_;
    bool is_virtual_ = false;
    bool replays_ = false;
    bool has_guardian_ = false;
    hal::SetupTime setup_time_;
    std::string previous_report_;

    hal::bus::ReportLock lock_;
    std::unique_ptr<GuardianProcess> guardian_;
    std::atomic<bool> is_alive_{true};  // written by the background thread
    std::atomic<bool> stalls_{false};  // written by the background thread
    std::atomic<bool> is_interrupted_{false};  // written by the emergency function
    std::atomic<std::uint64_t> safe_cycle_{0};  // in which that was called; 0: update has run since

    std::unique_ptr<StopTransmitter> local_;
    std::int64_t local_ns_ = 0;  // when it has worked last
    GuardianMemory own_memory_;
    StopRecord own_stop_;
    std::uint32_t stop_count_ = 0;

    const hal_faults* faults_ = nullptr;
    hal::LastingFault guardian_fault_, stall_fault_, outcome_fault_, delay_fault_, link_fault_;
    hal::bus::FaultTexts fault_texts_{event_rows, 1,
                                      [this](Event event, std::size_t, std::string_view name) {
        return value_of(name, {.event = event, .stop = {}});
    }};
    bool was_estop_ = false;
    bool was_acknowledged_ = false;
    std::uint32_t acknowledged_stop_ = 0;  // Status::stops

    // of the background thread
    std::uint64_t turns_ = 0;
    std::int64_t silent_ns_ = 0;
    std::int64_t turned_ns_ = 0;
    std::int64_t replace_at_ns_ = 0;
    mutable std::mutex problem_mutex_;  // this thread and that of the reporter
    std::string problem_;
    Status shown_;
    bool told_stall_ = false;
    bool told_ready_ = true;
    hal::Reporter<EventRecord> reporter_{
        name_, [this](const EventRecord& record) { return line(record); }};
    hal::Background background_{[this](std::int64_t now, bool may_wait) { turn(now, may_wait); }};
};

}  // namespace

HAL_COMPONENT(FrameGuardian, "frame_guardian",
              "Sends stop frames on CAN or Ethernet when the machine ends, hangs or is killed", R"(
For devices without a supervision of their own: a drive that keeps its last command when nothing more
arrives. A process of its own, the guardian, holds the link open and watches this one. It sends the
frames of `send=` when the process ends, however that happens, when no cycle has run for
`heartbeat_ms=`, when the thread is stopped or has a fault, on `unloadrt`, and while `estop` is TRUE.

    loadrt frame_guardian link=sim:robot send="201#0000,000#0200" confirm="701#04"
    addf frame-guardian.0.update servo

Here speed 0 for drive 1, then "stop" for all CANopen nodes (CiA 301, NMT); node 1 confirms with its
heartbeat, state stopped. A real bus is `link=can:can0`. The frames are sent `repeat=` times,
`every_ms=` apart; with `confirm=` until each of its frames has been received, and at most `repeat=`
times.

A CAN frame counts as sent when its echo shows that another node has acknowledged it (`sim:`, and
`can:` with a controller that returns what it has sent). On `eth:` and the other drivers it is handed
to the driver, and the messages state that. A frame that the link does not accept or acknowledge is
sent again until it does. Ethernet frames are written whole, without check sequence:
`send=01005E000001.020000000001.88B5.0000`.

The fault of a stop that was not sent or not confirmed lasts until the next stop, or a rising edge of
`acknowledge`. A guardian that has ended or stalls is a fault as well, and another one takes over.

The component and other users share the interface; only their frames are mixed with these. A serial
adapter (`slcan:`) has one user at a time. On `sim:` there is no guardian: the component sends the
frames itself, all of them once when the thread is stopped. `stopped` becomes FALSE when cycles run
again and no reason lasts: the guardian starts nothing, and what drives the devices must ask for
an edge of its own.

The guardian does not help when the cable is cut or the power fails. Prefer the supervision of the
device (heartbeat consumer 1016h, node guarding, watchdog of the SYNC) where it has one.
)")
