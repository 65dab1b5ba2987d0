// SPDX-License-Identifier: MIT
#include <atomic>
#include <cstdio>
#include <iterator>
#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>

#include "bus/guardian/program_path.hpp"
#include "bus/guardian/report.hpp"
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
constexpr std::int64_t stall_ns = 500 * millisecond;  // of the guardian, whose turns take 5 ms

struct EventRecord {
    Event event = Event::stopping;
    StopReason reason = StopReason::none;
    std::uint32_t rounds = 0;
    std::int64_t elapsed_ns = 0;
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
        shown_ = Status{Phase::watching};
        silent_ns_ = 0;
        last_ns_ = 0;
        reporter_.start();
        background_.start();
    }

    void stop() noexcept {
        background_.stop();
        if (local_) {
            setup_time_.expect(local_->closing_ns(), hal::can::closing_text);
            own_memory_.stop(StopReason::unload);
            work_local(local_ns_);
            report_outcome();
            local_.reset();
        }
        end_guardian();
        reporter_.stop();
    }

    void update(hal::Cycle cycle) noexcept {
        GuardianMemory& memory = this->memory();
        memory.limit_ns.store(
            std::max<std::int64_t>(heartbeat_ms_ * millisecond, 3 * cycle.period_ns()),
            std::memory_order_relaxed);
        if (is_interrupted_.exchange(false, std::memory_order_acquire)) {
            memory.stop_held.fetch_and(~bit_of(StopReason::fault), std::memory_order_release);
        }
        follow_estop(memory);
        memory.heartbeat.fetch_add(1, std::memory_order_release);
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
        constexpr std::uint32_t own = bit_of(StopReason::fault);
        const auto held = memory.stop_held.fetch_or(own, std::memory_order_release);
        if ((held & own) == 0) {
            memory.stop(StopReason::fault);
        }
        if (local_) {
            work_local(cycle.start_ns());
        }
    }

private:
    /// Of the guardian; without one, of the component.
    GuardianMemory& memory() noexcept { return guardian_ ? guardian_->memory() : own_memory_; }

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
        own_stops_ = {};
        own_memory_.stop_held.store(0);
        stop_count_ = own_memory_.stop_count.load();
    }

    /// What a guardian does in its turns. [realtime]
    void work_local(std::int64_t now) noexcept {
        local_ns_ = now;
        const std::uint32_t count = own_memory_.stop_count.load(std::memory_order_acquire);
        if (count != stop_count_) {
            stop_count_ = count;
            ++own_stops_.stops;
            own_stops_.phase = Phase::stopping;
            local_->begin(now);
        }
        local_->work(now);
        if (own_stops_.phase == Phase::stopping && local_->is_over()) {
            own_stops_.phase = Phase::stopped;
        }
        const bool is_held = own_memory_.stop_held.load(std::memory_order_acquire) != 0;
        if (own_stops_.phase == Phase::stopped && !is_held) {
            own_stops_.phase = Phase::watching;
        }
        own_stops_.outcome = local_->outcome();
        own_memory_.reason.store(own_memory_.stop_reason.load(std::memory_order_relaxed),
                                 std::memory_order_relaxed);
        own_memory_.rounds.store(local_->rounds_sent(), std::memory_order_relaxed);
        own_memory_.elapsed_ns.store(local_->elapsed_ns(), std::memory_order_relaxed);
        own_memory_.status.store(own_stops_.word(), std::memory_order_release);
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
        const std::string report = hal::bus::report_file("frames-" + link_.get() + "-" + name_);
        previous_report_ = hal::bus::take_report(report);
        guardian_ = std::make_unique<GuardianProcess>();
        const std::string problem = guardian_->start({.program = program(),
                                                      .name = name_,
                                                      .link = link_.get(),
                                                      .frames = frames_.get(),
                                                      .confirmations = confirmations_.get(),
                                                      .schedule = schedule(),
                                                      .report = report});
        if (!problem.empty()) {
            guardian_.reset();
            throw std::runtime_error(problem);
        }
        is_alive_.store(true);
        if (!previous_report_.empty()) {
            reporter_.tell({Event::previous_stop});
        }
    }

    void end_guardian() noexcept {
        if (!guardian_) return;
        const std::int64_t limit =
            unload_ns + repeat_ * every_ms_ * millisecond + 1000 * millisecond;
        setup_time_.expect(limit, "the guardian still sends the stop frames");
        const bool was_alive = is_alive_.load();
        const bool has_ended = guardian_->end(limit);
        if (!has_ended) {
            reporter_.tell({Event::guardian_killed});
        } else if (was_alive) {
            report_outcome();
            report_unsent();
        }
        guardian_.reset();
    }

    /// The guardian has ended by request, and nothing sends what it has not sent.
    void report_unsent() noexcept {
        const GuardianMemory& memory = this->memory();
        const Outcome outcome = Status::of(memory.status.load()).outcome;
        if (outcome != Outcome::sending && outcome != Outcome::delayed) return;
        reporter_.tell({.event = Event::not_sent, .rounds = memory.rounds.load()});
    }

    /// Of the background thread: sees the end of the guardian, and reports what it does, also while
    /// no cycle runs.
    void turn(std::int64_t, bool may_wait) noexcept {
        const std::int64_t pause_ns = may_wait ? 20 * millisecond : 0;
        if (!guardian_ || !is_alive_.load(std::memory_order_relaxed)) {
            sleep_for(pause_ns);
        } else if (guardian_->has_ended_within(pause_ns)) {
            is_alive_.store(false, std::memory_order_release);
            reporter_.tell({Event::guardian_lost});
            return;
        } else if (stalls_.load(std::memory_order_relaxed)) {
            guardian_->resume();
        }
        report_outcome();
    }

    static void sleep_for(std::int64_t ns) noexcept {
        if (ns == 0) return;
        const timespec pause = hal::link::to_timespec(ns);
        nanosleep(&pause, nullptr);
    }

    /// Reports what has changed since the last call.
    void report_outcome() noexcept {
        const GuardianMemory& memory = this->memory();
        const Status now = Status::of(memory.status.load(std::memory_order_acquire));
        EventRecord record{.reason = static_cast<StopReason>(memory.reason.load()),
                           .rounds = memory.rounds.load(),
                           .elapsed_ns = memory.elapsed_ns.load()};
        const auto tell = [&](Event event) {
            record.event = event;
            reporter_.tell(record);
        };
        const bool is_new = now.stops != shown_.stops;
        if (is_new) {
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
        if (const bool stalls = stalls_.load(std::memory_order_relaxed); stalls != told_stall_) {
            told_stall_ = stalls;
            tell(stalls ? Event::guardian_stalls : Event::guardian_runs);
        }
        shown_ = now;
    }

    std::string line(const EventRecord& record) const {
        return hal::bus::format(event_rows[static_cast<std::size_t>(record.event)].text,
                                hal::bus::Text::line,
                                [&](std::string_view name) { return value_of(name, record); });
    }
    std::string value_of(std::string_view name, const EventRecord& record) const {
        if (name == "link") return link_.get();
        if (name == "reason") return reason_texts[static_cast<std::size_t>(record.reason)];
        if (name == "report") return previous_report_;
        char text[48] = "";
        if (name == "rounds") {
            std::snprintf(text, sizeof text, "%u time%s", record.rounds,
                          record.rounds == 1 ? "" : "s");
        } else if (name == "time") {
            std::snprintf(text, sizeof text, "%.1f ms",
                          static_cast<double>(record.elapsed_ns) * 1e-6);
        }
        return text;
    }

    // --- Of the cycle

    void follow_estop(GuardianMemory& memory) noexcept {
        if (estop && !was_estop_) {
            memory.stop_held.fetch_or(bit_of(StopReason::estop), std::memory_order_release);
            memory.stop(StopReason::estop);
        } else if (!estop && was_estop_) {
            memory.stop_held.fetch_and(~bit_of(StopReason::estop), std::memory_order_release);
        }
        was_estop_ = estop;
    }

    View look(hal::Cycle cycle) noexcept {
        if (local_) {
            work_local(cycle.start_ns());
            return {.status = own_stops_};
        }
        if (!guardian_) return {};
        watch_turns(cycle);
        const GuardianMemory& memory = guardian_->memory();
        return {.is_alive = is_alive_.load(std::memory_order_acquire),
                .stalls = stalls_.load(std::memory_order_relaxed),
                .status = Status::of(memory.status.load(std::memory_order_acquire))};
    }

    /// Only time in which cycles run counts: where they do not, the guardian may stand as well.
    void watch_turns(hal::Cycle cycle) noexcept {
        const std::int64_t elapsed = std::min(cycle.start_ns() - last_ns_, 2 * cycle.period_ns());
        last_ns_ = cycle.start_ns();
        const std::uint64_t turns = guardian_->memory().turns.load(std::memory_order_relaxed);
        silent_ns_ = turns == turns_ ? silent_ns_ + elapsed : 0;
        turns_ = turns;
        stalls_.store(silent_ns_ > stall_ns, std::memory_order_relaxed);
    }

    void show(const View& view) noexcept {
        set(guardian_fault_, Event::guardian_lost, !view.is_alive);
        set(stall_fault_, Event::guardian_stalls, view.is_alive && view.stalls);
        const bool stops_now =
            view.status.phase == Phase::stopping || view.status.phase == Phase::stopped;
        const Outcome outcome = stops_now ? view.status.outcome : Outcome::none;
        set(outcome_fault_, Event::unconfirmed, outcome == Outcome::unconfirmed);
        set(link_fault_, Event::delayed, outcome == Outcome::delayed);
        const bool is_sent = outcome == Outcome::sent || outcome == Outcome::confirmed;
        guarded = has_guardian_ && view.is_alive && !view.stalls;
        stopped = view.status.phase == Phase::stopped && is_sent;
        fault = guardian_fault_.lasts() || stall_fault_.lasts() || outcome_fault_.lasts() ||
                link_fault_.lasts();
        stops = view.status.stops;
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

    hal::In<bool> estop{*this, "estop", "TRUE: the stop frames are sent"};
    hal::Out<bool> guarded{*this, "guarded",
                           "a guardian sends the stop frames when this process ends; FALSE on a "
                           "bus in memory"};
    hal::Out<bool> stopped{*this, "stopped",
                           "the stop frames have been sent, and confirmed if that is asked for; "
                           "the reason lasts"};
    hal::Out<bool> fault{*this, "fault",
                         "the guardian is lost or stalls, or the stop frames are not sent or not "
                         "confirmed"};
    hal::Out<std::uint32_t> stops{*this, "stops", "stops begun, modulo 65536"};

    const std::string name_;
    StopFrames parsed_;
    bool is_virtual_ = false;
    bool replays_ = false;
    bool has_guardian_ = false;
    hal::SetupTime setup_time_;
    std::string previous_report_;

    std::unique_ptr<GuardianProcess> guardian_;
    std::atomic<bool> is_alive_{true};  // written by the background thread
    std::atomic<bool> stalls_{false};  // written by the cycle
    std::atomic<bool> is_interrupted_{false};  // written by the emergency function

    std::unique_ptr<StopTransmitter> local_;
    std::int64_t local_ns_ = 0;  // when it has worked last
    GuardianMemory own_memory_;
    Status own_stops_;
    std::uint32_t stop_count_ = 0;

    const hal_faults* faults_ = nullptr;
    hal::LastingFault guardian_fault_, stall_fault_, outcome_fault_, link_fault_;
    hal::bus::FaultTexts fault_texts_{event_rows, 1,
                                      [this](Event event, std::size_t, std::string_view name) {
        return value_of(name, {.event = event});
    }};
    bool was_estop_ = false;
    std::uint64_t turns_ = 0;
    std::int64_t silent_ns_ = 0;
    std::int64_t last_ns_ = 0;

    // of the background thread
    Status shown_;
    bool told_stall_ = false;
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

A CAN frame counts as sent when another node has acknowledged it (`can:`, `sim:`). On `eth:` and the
other drivers it counts when the driver has taken it. Ethernet frames are written whole, without
check sequence: `send=01005E000001.020000000001.88B5.0000`.

The component and other users share the interface; only their frames are mixed with these. A serial
adapter (`slcan:`) has one user at a time. On `sim:` there is no guardian: the component sends the
frames itself, all of them once when the thread is stopped. `stopped` becomes FALSE when cycles run
again and no reason lasts: the guardian starts nothing, and what drives the devices must ask for
an edge of its own.

The guardian does not help when the cable is cut or the power fails. Prefer the supervision of the
device (heartbeat consumer 1016h, node guarding, watchdog of the SYNC) where it has one.
)")
