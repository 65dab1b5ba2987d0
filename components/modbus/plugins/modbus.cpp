// SPDX-License-Identifier: MIT
#include <bit>
#include <deque>
#include <optional>

#include "bus/component/bus_component.hpp"
#include "bus/guardian/program_path.hpp"
#include "bus/guardian/report.hpp"
#include "bus/guardian/report_lock.hpp"
#include "hal/background.hpp"
#include "hal/journal.hpp"
#include "hal/reporter.hpp"
#include "hal/setup_time.hpp"
#include "modbus/guardian/guardian_process.hpp"
#include "modbus/master/event_texts.hpp"
#include "modbus/master/followed_image.hpp"
#include "modbus/master/local_master.hpp"
#include "modbus_arguments.hpp"
#include "slave_pins.hpp"

namespace {

using namespace hal::modbus;

constexpr std::int64_t millisecond = 1'000'000;
constexpr std::int64_t stall_ns = 500 * millisecond;  // of the guardian, whose turns take 5 ms

struct Modbus : hal::bus::BusComponent {
    explicit Modbus(const hal_host* host) : BusComponent(host, "modbus.0") {
        arguments_.load("modbus");
        if (!arguments_.loaded) return;
        const Bus& bus = arguments_.bus;
        texts_ = std::make_unique<EventTexts>(bus, arguments_.plan);
        reporter_ = std::make_unique<hal::Reporter<EventRecord>>(
            name_, [this](const EventRecord& record) { return line(record); }, 256,
            &EventTexts::subject);
        if (!bus.broadcast_stop.empty()) {
            broadcasts_.emplace(*this, receive_, "broadcasts",
                                "how often the broadcast stop was sent; no slave acknowledges it");
        }
        memory_ = hal::bus::allocate_in_instance(Image::size_of(bus, arguments_.plan), 64);
        for (std::size_t n = 0; n < bus.slaves.size(); ++n) {
            slaves_.push_back(hal::bus::place<SlavePins>(*this, receive_, transmit_, bus,
                                                         arguments_.plan, n,
                                                         SharedPins{set_points_, ages_}));
            if (bus.slaves[n].drive) {
                drives_.push_back(slaves_.back().get());
            }
            faults_of_slaves_.emplace_back();
            stop_faults_of_slaves_.emplace_back();
            rejections_of_slaves_.emplace_back();
            changes_of_slaves_.emplace_back();
        }
    }

    void start() {
        set_points_.rewrite();
        if (!arguments_.loaded) {
            throw std::runtime_error("missing configuration: write config=FILE.modbus");
        }
        const auto* host = hal::extension<hal_background>(HAL_BACKGROUND);
        is_virtual_ = host != nullptr && host->is_virtual != 0;
        const hal::line::Description line = hal::line::describe(arguments_.bus.link);
        const bool replays = hal::is_executed_again();
        if (is_virtual_ && !line.in_memory && !replays) {
            throw std::runtime_error("'" + arguments_.bus.link +
                                     "' is a real line, and a simulation has no time in which its "
                                     "slaves could answer; write link=sim:NAME, or use hal run");
        }
        has_guardian_ = !is_virtual_ && !line.in_memory && arguments_.bus.guardian &&
                        arguments_.bus.has_stops();
        hal::journaled(has_guardian_);
        const hal::JournaledSource journaled;  // FollowedImage, alive_
        if (has_guardian_ && !replays) {
            start_guardian();
        } else {
            // a re-execution opens no real line: what the cycle sees of it is in the journal
            start_local(replays ? "sim:replay" : arguments_.bus.link);
        }
        followed_.attach(image_, arguments_.bus, arguments_.plan);
        setup_time_.start();
        begin_cycles();
        receive_was_missing_ = false;
        is_alive_.store(true);
        is_stopped_by_another_ = false;
        guardian_stalls_.store(false);
        guardian_silent_ns_ = 0;
        shown_ns_ = 0;
        reporter_->start();
        background_.start();
    }

    void stop() noexcept {
        if (has_image_ && !is_virtual_ && arguments_.bus.has_stops()) {
            setup_time_.expect(stop_limit_ns(arguments_.plan, arguments_.bus),
                               "the stop telegrams are sent until the slaves acknowledge them");
        }
        if (local_) {
            stop_local();
        }
        background_.stop();
        end_guardian();
        followed_.take();
        for (EventRecord record; has_image_ && followed_.pop(record);) {
            reporter_->tell(record);
        }
        raise_unconfirmed_stops();
        if (reporter_) {
            reporter_->stop();
        }
        has_image_ = false;
        local_.reset();
        guardian_.reset();
        lock_.release();
    }

    void receive(hal::Cycle cycle) noexcept {
        if (!has_image_) return;
        const std::int64_t now = cycle.start_ns();
        followed_.take();
        alive_ = is_alive_.load(std::memory_order_acquire);
        if (followed_.is_journaled()) {
            hal::journaled(alive_);
        }
        ImageHeader& header = image_.header();
        header.cycles.count(std::max(arguments_.bus.heartbeat_ns, 3 * cycle.period_ns()));
        const hal::bus::Turn turn = receive_turn(cycle);
        if (begins_anew(turn)) {
            header.requests.release(StopReason::fault);
            for (SlavePins* drive : drives_) {
                drive->require_edge();
            }
        }
        if (turn == hal::bus::Turn::leaves) {
            image_.stop(StopReason::fault);
            header.outputs_valid.store(0, std::memory_order_release);
        }
        drain_events();
        const std::int64_t elapsed = now - shown_ns_;
        watch_guardian(std::min(elapsed, 2 * cycle.period_ns()));
        // a thread that was stopped has written safe values to pins
        const bool refresh = elapsed > 3 * cycle.period_ns() / 2;
        shown_ns_ = now;
        show(now, exchanges() && !is_offline(turn), refresh);
    }

    void transmit(hal::Cycle cycle) noexcept {
        if (!has_image_) return;
        const bool is_paired = functions_.transmit(cycle);
        follow_estop();
        follow_receive(cycle);
        if (!is_paired) return;
        const std::int64_t now = cycle.start_ns();
        ImageHeader& header = image_.header();
        followed_.take();
        const ImageHeader& seen = followed_.seen().header();
        const bool may_run = exchanges() &&
                             seen.phase.load(std::memory_order_acquire) ==
                                 static_cast<std::uint32_t>(Phase::running) &&
                             !seen.requests.holds_any();
        bool invalid = set_points_.transmit(image_);
        for (SlavePins* drive : drives_) {
            invalid = drive->command(followed_.seen(), image_, now, may_run) || invalid;
        }
        record_invalid_inputs(invalid);
        header.outputs_valid.store(1, std::memory_order_release);
    }

    void make_safe(hal::Cycle) noexcept {
        if (!has_image_) return;
        image_.header().requests.hold(StopReason::fault);
        image_.header().outputs_valid.store(0, std::memory_order_release);
        image_.stop(StopReason::fault);
        interrupt();
    }

private:
    /// Returns whether the guardian, if there is one, exchanges telegrams. [realtime]
    bool exchanges() const noexcept {
        return alive_ && !guardian_stalls_.load(std::memory_order_relaxed);
    }
    /// `elapsed`: time since the last cycle, as far as this thread ran. [realtime]
    void watch_guardian(std::int64_t elapsed_ns) noexcept {
        if (!has_guardian_) return;
        if (!alive_) {
            if (!guardian_fault_.lasts()) {
                tell({Event::guardian_lost, 0, 0, 0});
            }
            return;
        }
        const std::uint64_t turns = followed_.seen().header().turns.load(std::memory_order_relaxed);
        guardian_silent_ns_ = turns == guardian_turns_ ? guardian_silent_ns_ + elapsed_ns : 0;
        guardian_turns_ = turns;
        const bool stalls = guardian_silent_ns_ > stall_ns;
        if (guardian_stalls_.exchange(stalls, std::memory_order_relaxed) != stalls) {
            tell({stalls ? Event::guardian_stalls : Event::guardian_runs, 0, 0, 0});
        }
    }

    // --- The master, in this process or in the guardian

    static std::string program() {
        return hal::bus::guardian_program(
            reinterpret_cast<const void*>(
                static_cast<hal::line::Description (*)(std::string_view)>(&hal::line::describe)),
            "hal-guardian");
    }

    void start_guardian() {
        const std::string& link = arguments_.bus.link;
        const std::string report = hal::bus::report_file(link);
        if (const std::string problem = lock_.acquire(report, link); !problem.empty()) {
            throw std::runtime_error(problem);
        }
        guardian_ = std::make_unique<GuardianProcess>();
        const std::string problem =
            guardian_->start({.program = program(),
                              .name = name_,
                              .file = arguments_.config.get(),
                              .link = link,
                              .report = report,
                              .lock = lock_.descriptor()},
                             arguments_.text, arguments_.bus, arguments_.plan);
        if (!problem.empty()) {
            guardian_.reset();
            lock_.release();
            throw std::runtime_error(problem);
        }
        previous_report_ = hal::bus::take_report(report);  // now that nothing prevents its print
        image_ = guardian_->image();
        has_image_ = true;
        if (!previous_report_.empty()) {
            reporter_->tell({Event::previous_stop, 0, 0, 0});
        }
    }

    void end_guardian() noexcept {
        if (!guardian_) return;
        if (!guardian_->end()) {
            reporter_->tell({Event::guardian_killed, 0, 0, guardian_->end_limit_ns()});
            stop_drives();
        } else if (!is_alive_.load() && !is_stopped_by_another_) {
            stop_drives();
        }
    }

    /// The guardian has ended, and the drives go on: another one sends the stop telegrams, and
    /// ends. Not real time; no other thread reports events meanwhile.
    void stop_drives() noexcept {
        const std::int64_t since = hal::link::monotonic_ns();
        GuardianProcess another;
        bool has_started = false;
        try {
            has_started = another
                              .start({.program = program(),
                                      .name = name_,
                                      .file = arguments_.config.get(),
                                      .link = arguments_.bus.link,
                                      .report = {}},
                                     arguments_.text, arguments_.bus, arguments_.plan)
                              .empty();
        } catch (...) {  // out of memory
        }
        another.end();
        is_stopped_by_another_ = true;
        for (std::uint32_t n = 0; n < arguments_.bus.slaves.size(); ++n) {
            if (arguments_.bus.slaves[n].stop.empty()) continue;
            const bool stopped = has_started && another.image().slave(n).stopped.load() != 0;
            is_stopped_by_another_ = is_stopped_by_another_ && stopped;
            image_.slave(n).stopped.store(stopped ? 1 : 0, std::memory_order_relaxed);
            image_.touch(n);
            image_.tell({stopped ? Event::stop_acknowledged : Event::stop_unconfirmed, n, 0,
                         hal::link::monotonic_ns() - since});
        }
    }

    /// At the end: whether a slave has acknowledged its stop telegrams at last is in the image, also
    /// when the event was reported by an earlier stop.
    void raise_unconfirmed_stops() noexcept {
        if (!has_image_ || is_virtual_) return;
        for (std::uint32_t n = 0; n < arguments_.bus.slaves.size(); ++n) {
            const bool is_unconfirmed =
                !arguments_.bus.slaves[n].stop.empty() &&
                image_.slave(n).stopped.load(std::memory_order_relaxed) == 0;
            if (!is_unconfirmed) continue;
            const auto* const text = texts_->fault(Event::stop_unconfirmed, n);
            raise(text->text.c_str());
        }
    }

    void start_local(const std::string& link) {
        auto opened = hal::line::open(link, arguments_.bus.line);
        if (!opened) throw std::runtime_error(opened.problem);
        image_ = Image(memory_, arguments_.bus, arguments_.plan, true);
        has_image_ = true;
        local_ = std::make_unique<LocalMaster>(arguments_.bus, arguments_.plan, image_,
                                               std::move(opened.line));
    }

    /// Waits for the stop telegrams. On the virtual clock no time passes during an unload, and the
    /// slaves of a simulation end with the machine.
    void stop_local() noexcept {
        if (is_virtual_ || !arguments_.bus.has_stops()) return;
        image_.header().requests.end();
        const std::int64_t limit = stop_limit_ns(arguments_.plan, arguments_.bus);
        const std::int64_t begin = hal::link::monotonic_ns();
        while (!image_.has_stopped()) {
            if (hal::link::monotonic_ns() - begin > limit) {
                reporter_->tell({Event::stop_unfinished, 0, 0, limit});
                return;
            }
            const timespec pause{0, 5 * millisecond};
            nanosleep(&pause, nullptr);
        }
    }

    void turn(std::int64_t now_ns, bool may_wait) noexcept {
        if (local_) {
            local_->turn(now_ns, may_wait);
        } else if (guardian_ && is_alive_.load(std::memory_order_relaxed)) {
            if (guardian_->has_ended_within(may_wait ? 50 * millisecond : 0)) {
                is_alive_.store(false, std::memory_order_release);
                stop_drives();
            } else if (guardian_stalls_.load(std::memory_order_relaxed)) {
                guardian_->resume();
            }
        } else if (may_wait) {
            const timespec pause{0, 50 * millisecond};
            nanosleep(&pause, nullptr);
        }
    }

    // --- Events and pins

    std::string line(const EventRecord& record) const {
        if (record.event == Event::previous_stop) {
            return "the guardian of the previous run: " + previous_report_;
        }
        return texts_->line(record);
    }

    void drain_events() noexcept {
        if (!has_image_) return;
        for (EventRecord record; followed_.pop(record);) {
            tell(record);
        }
    }

    void tell(const EventRecord& record) noexcept {
        reporter_->tell(record);
        hal::LastingFault& condition = fault_of(record);
        const auto& row = event_rows[static_cast<std::size_t>(record.event)];
        lasting_faults_ -= condition.lasts() ? 1 : 0;
        if (row.effect == hal::bus::Effect::ends) {
            end(condition);
        } else if (const auto* text = texts_->fault(record.event, record.slave)) {
            begin(condition, text->text);
        }
        lasting_faults_ += condition.lasts() ? 1 : 0;
    }

    hal::LastingFault& fault_of(const EventRecord& record) noexcept {
        switch (record.event) {
        case Event::line_lost:
        case Event::line_open: return line_fault_;
        case Event::guardian_lost: return guardian_fault_;
        case Event::guardian_stalls:
        case Event::guardian_runs: return stall_fault_;
        case Event::stop_acknowledged:
        case Event::stop_unconfirmed: return stop_faults_of_slaves_[record.slave];
        case Event::slave_rejects:
        case Event::slave_accepts: return rejections_of_slaves_[record.slave];
        case Event::value_changes:
        case Event::values_accepted: return changes_of_slaves_[record.slave];
        default: return faults_of_slaves_[record.slave];
        }
    }

    void show(std::int64_t now, bool is_alive, bool refresh) noexcept {
        const ImageHeader& header = followed_.seen().header();
        refresh = refresh || is_alive != was_alive_;
        was_alive_ = is_alive;
        show_slaves(is_alive, refresh);
        ages_.show(now);
        for (SlavePins* drive : drives_) {
            drive->show_drive(followed_.seen());
        }
        online = online_slaves_ == slaves_.size() && is_alive;
        fault = lasting_faults_ != 0;
        guarded = has_guardian_ && is_alive;
        telegrams = header.telegrams.load(std::memory_order_relaxed);
        if (broadcasts_) {
            *broadcasts_ = header.broadcasts.load(std::memory_order_relaxed);
        }
        show_load(now, header.busy_ns.load(std::memory_order_relaxed));
    }

    /// Shows the slaves that have changed; `refresh`: all. What is not shown is not read: a slave
    /// costs a cycle its age only.
    void show_slaves(bool is_alive, bool refresh) noexcept {
        for (std::size_t word = 0; word < ImageHeader::slave_words && word * 64 < slaves_.size();
             ++word) {
            std::uint64_t changed = followed_.seen().take_changed(word);
            if (refresh) {
                const std::size_t count = std::min<std::size_t>(64, slaves_.size() - word * 64);
                changed = ~std::uint64_t{0} >> (64 - count);
            }
            for (; changed != 0; changed &= changed - 1) {
                SlavePins& slave = *slaves_[word * 64 + std::countr_zero(changed)];
                online_slaves_ -= slave.is_online() ? 1 : 0;
                slave.show(followed_.seen(), is_alive);
                online_slaves_ += slave.is_online() ? 1 : 0;
            }
        }
    }

    /// The share of the last second.
    void show_load(std::int64_t now, std::int64_t busy) noexcept {
        if (load_since_ == 0) {
            load_since_ = now;
            load_busy_ = busy;
        }
        const std::int64_t elapsed = now - load_since_;
        if (elapsed < 1000 * millisecond) return;
        load = static_cast<double>(busy - load_busy_) / static_cast<double>(elapsed);
        load_since_ = now;
        load_busy_ = busy;
    }

    /// Drives keep their last command: without receive() they are stopped, and start with another
    /// edge once it is back.
    void follow_receive(hal::Cycle cycle) noexcept {
        const bool is_missing = functions_.receive_is_missing();
        if (is_missing && !receive_was_missing_) {
            make_safe(cycle);
        }
        receive_was_missing_ = is_missing;
    }

    void follow_estop() noexcept {
        ImageHeader& header = image_.header();
        if (estop && !was_estop_) {
            header.requests.hold(StopReason::estop);
            image_.stop(StopReason::estop);
        } else if (!estop && was_estop_) {
            header.requests.release(StopReason::estop);
        }
        was_estop_ = estop;
    }

    ModbusArguments arguments_{*this};
    hal::Function receive_{*this,
                           "receive",
                           &Modbus::receive,
                           "shows the values that have arrived; first in the thread",
                           {.required = true}};
    hal::Function transmit_{*this,
                            "transmit",
                            &Modbus::transmit,
                            "passes the input pins on to the master; last in the thread",
                            {.required = true}};
    hal::Emergency emergency_{*this, &Modbus::make_safe,
                              "sends the stop telegrams, and nothing else until the thread runs"};

    hal::In<bool> estop{
        *this, transmit_, "estop",
        "TRUE: the stop telegrams are sent until they are acknowledged, and nothing "
        "else is written"};
    hal::Out<bool> online{*this, receive_, "online", "all slaves answer", {.safe = false}};
    hal::Out<bool> fault{*this, receive_, "fault",
                         "a slave is offline or rejects requests, a value of it is not accepted, "
                         "or the line or the guardian is lost"};
    hal::Out<bool> guarded{*this, receive_, "guarded",
                           "a guardian sends the stop telegrams when this process ends"};
    hal::Out<double> load{*this, receive_, "load",
                          "share of the time in which the line is busy, 0..1"};
    hal::Out<std::uint64_t> telegrams{*this, receive_, "telegrams", "requests that were answered"};
    std::optional<hal::Out<std::uint32_t>> broadcasts_;  ///< with a broadcast stop

    std::unique_ptr<EventTexts> texts_;
    std::unique_ptr<hal::Reporter<EventRecord>> reporter_;
    SetPointPins set_points_;
    AgePins ages_;
    std::vector<hal::bus::Placed<SlavePins>> slaves_;
    std::vector<SlavePins*> drives_;
    std::size_t online_slaves_ = 0;
    std::deque<hal::LastingFault> faults_of_slaves_, stop_faults_of_slaves_, rejections_of_slaves_,
        changes_of_slaves_;
    hal::LastingFault line_fault_, guardian_fault_, stall_fault_;
    hal::SetupTime setup_time_;
    std::string previous_report_;

    void* memory_ = nullptr;  // of the image of a local master
    Image image_;
    FollowedImage followed_;  // by the cycle
    bool has_image_ = false;
    std::unique_ptr<LocalMaster> local_;
    hal::bus::ReportLock lock_;
    std::unique_ptr<GuardianProcess> guardian_;
    hal::Background background_{[this](std::int64_t now, bool may_wait) { turn(now, may_wait); }};
    std::atomic<bool> is_alive_{true};  // written by the background thread
    bool alive_ = true;  // what receive() has seen of it
    std::atomic<bool> guardian_stalls_{false};  // written by the cycle
    bool is_stopped_by_another_ = false;  // guardian; of the background thread
    std::uint64_t guardian_turns_ = 0;
    std::int64_t guardian_silent_ns_ = 0;
    bool is_virtual_ = false;
    bool has_guardian_ = false;
    bool receive_was_missing_ = false;
    bool was_estop_ = false;
    std::int64_t shown_ns_ = 0;
    int lasting_faults_ = 0;
    bool was_alive_ = false;
    std::int64_t load_since_ = 0;
    std::int64_t load_busy_ = 0;
};

}  // namespace

HAL_COMPONENT(Modbus, "modbus",
              "Modbus master (RTU and TCP): registers as pins, drives as spindles, stop telegrams",
              R"(
Exchanges registers with the slaves of a Modbus line in the background. A configuration names the
line, the slaves and their values:

`spindle.modbus`:

    [bus]
    link = sim:spindle
    baud = 19200

    [slave 1 spindle]
    profile = delta-ms300
    max-speed = 24000
    max-frequency = 400

    [slave 2 coolant]
    read level = input 0x0010 s16 scale 0.1 unit l every 1s
    write pump = coil 3
    stop = coil 3 0

A real line is `link = serial:/dev/ttyUSB0`. The netlist:

    loadrt modbus config=spindle.modbus
    addf modbus.0.receive servo-thread
    addf modbus.0.transmit servo-thread
    net speed => modbus.0.spindle.speed-cmd
    sets speed 12000

A cycle only copies values. The telegrams are exchanged by another process, the guardian, when a
slave has stop telegrams, else by a background thread. `age` is how old the values of a slave are.
Set-points that have changed are sent first. A slave that does not answer is offline after three
requests and then uses at most 5 % of the line.

A drive that is online starts with a rising edge of `run`, once its speed has been read. After a
stop, a lost slave or an e-stop it needs another edge. The stop telegrams are sent when `estop` is
TRUE, until they are acknowledged, when the thread is stopped or hangs, on `unloadrt`, and when the
process ends, however that happens.

`docs/modbus.md` has the keys of the configuration and the table of profiles. `hal modbus plan FILE`
shows the telegrams; `hal modbus scan`, `read` and `write` talk to slaves by hand;
`hal node modbus FILE` emulates the slaves of a file.
)")
