// SPDX-License-Identifier: MIT
#include "boot_node.hpp"

#include <algorithm>

namespace hal::canopen {

namespace {

constexpr unsigned max_starts = 5;
constexpr unsigned max_reboots = 8;  // during one boot
constexpr Time min_start_wait = 100 * millisecond;

/// Returns the letter for a boot that is interrupted in `step` by one restart after another.
BootResult letter_of_interrupted(Step step) noexcept {
    switch (step) {
    case Step::identifying:
    case Step::checking_state: return BootResult::no_answer;
    case Step::checking_program: return BootResult::update;
    case Step::watching: return BootResult::watching;
    default: return BootResult::configuration;
    }
}

/// Returns true for a failure that may mean that the node is not on the bus.
bool is_silence(Cause cause) noexcept {
    return cause == Cause::no_response || cause == Cause::heartbeat || cause == Cause::guarding;
}

}  // namespace

Master::Node::Node(const NodeSetup& node_setup, RemoteNode& remote, Master& master)
    : setup(node_setup),
      remote_(remote),
      master_(master),
      supervision_(setup, remote),
      channel_(setup, status, remote, master.now_,
               setup.sdo_timeout > 0 ? setup.sdo_timeout : master.setup_.sdo.timeout, *this),
      boot_(channel_, supervision_, master.setup_.id) {
    status.id = setup.id;
    status.mandatory = setup.mandatory;
    if (setup.sdo_resends >= 0) {
        remote_.sdo().settings().resends = static_cast<unsigned>(setup.sdo_resends);
    }
}

// Steps and their boot.

void Master::Node::count_in_master(int by) noexcept {
    if (booting()) {
        master_.booting_ += static_cast<unsigned>(by);
    }
    if (status.step == Step::ready) {
        master_.ready_ += static_cast<unsigned>(by);
    }
}

void Master::Node::enter(Step step) noexcept {
    if (step == status.step) return;
    count_in_master(-1);
    status.step = step;
    count_in_master(1);
    master_.dirty_ = true;
    refresh();
    master_.events_.on_step(status);
}

void Master::Node::send(NmtCommand command) noexcept { master_.send(command, setup.id); }

void Master::Node::refresh() noexcept {
    status.state = remote_.state();
    status.boot_ups = remote_.boot_ups();
    status.wrong_toggles = remote_.wrong_toggles();
    status.emergencies = remote_.emergencies();
    status.emergency = remote_.emergency(0);
    status.error_register = remote_.error_register();
    status.last_heard = std::max(status.last_heard, remote_.last_heard());
}

void Master::Node::set_online() noexcept {
    missing = false;
    if (!status.online) {
        status.online = true;
        master_.dirty_ = true;
    }
}

void Master::Node::set_operational(bool operational) noexcept {
    if (status.operational != operational) {
        status.operational = operational;
        master_.dirty_ = true;
    }
}

void Master::Node::cancel_work() noexcept {
    channel_.stop();
    supervision_.stop(now());
    set_operational(false);
    running_.was_operational = false;
}

void Master::Node::resume_supervision() noexcept {
    if (supervision_.guarding()) {
        supervision_.guard(now());
    } else if (!unsupervised()) {
        supervision_.expect_heartbeat();
    }
}

void Master::Node::leave(Step step, Cause cause) noexcept {
    if (cause != Cause::none) {
        status.cause = cause;
        status.failed_in = status.step;
    }
    const bool was_watched = is_started_or_ready() || status.step == Step::stopped;
    cancel_work();
    if (step == Step::stopped) {
        stop_command_ = NmtCommand::stop;
        if (was_watched) {
            resume_supervision();
        }
    }
    wanted_since_ = -1;
    backoff_ = 0;
    missing = false;
    enter(step);
}

void Master::Node::begin(BootStart how) noexcept {
    cancel_work();
    ++status.attempts;
    status.begun = now();
    status.notes = 0;
    status.compared = status.written = 0;
    reboots_ = 0;
    foreign_.command = 0;
    if (wanted_since_ < 0) {
        wanted_since_ = now();
    }
    next_start_ = how;
    const auto parallel = master_.setup_.parallel;
    const unsigned others = master_.booting_ - (booting() ? 1U : 0U);
    if (parallel != 0 && others >= parallel) return enter(Step::queued);
    begin_now();
}

void Master::Node::begin_now() noexcept {
    const bool first_boot = status.result == BootResult::none;
    if (setup.keep_alive && next_start_ == BootStart::reset && first_boot) {
        next_start_ = BootStart::in_unknown_state;
    }
    boot_.begin(next_start_);
}

void Master::Node::on_response() noexcept {
    set_online();
    status.last_heard = now();
}

void Master::Node::on_boot_end() noexcept {
    const BootOutcome outcome = channel_.outcome();
    if (!canopen::booted(outcome.result)) return fail(outcome.result, outcome.cause);
    status.result = outcome.result;
    status.cause = Cause::none;
    status.booted = now();
    wanted_since_ = -1;
    running_.heartbeats = 0;
    if (outcome.result == BootResult::was_operational || !setup.start) return run();
    enter(Step::ready);
}

void Master::Node::on_sdo_frame(const Frame& f) noexcept {
    const bool asked = booting() && status.step >= Step::identifying;
    if (!asked) return;
    const auto found = boot_.on_sdo_frame(f);
    if (!found) return;
    channel_.note_object(found->index, found->sub, found->first, found->second);
    fail(found->letter, Cause::duplicate_id);
}

void Master::Node::poll() noexcept {
    switch (status.step) {
    case Step::queued:
        if (master_.booting_ < master_.setup_.parallel || master_.setup_.parallel == 0) {
            begin_now();
        }
        return;
    case Step::starting: return poll_starting();
    case Step::running:
        // stable since its start
        if (backoff_ != 0 && status.operational && now() - running_.since >= setup.retry) {
            backoff_ = 0;
        }
        return;
    case Step::waiting:
        if (now() >= status.next_try) {
            ++status.retries;
            begin(next_start_);
        }
        return;
    default: channel_.poll(); return;
    }
}

// Start and operation.

Time Master::Node::start_limit() const noexcept {
    return std::max<Time>(supervision_.limit(), min_start_wait);
}

void Master::Node::start(bool sent_to_all) noexcept {
    start_attempts_ = 0;
    if (!sent_to_all) {
        send(NmtCommand::start);
    }
    start_deadline_ = now() + start_limit();
    enter(Step::starting);
}

void Master::Node::poll_starting() noexcept {
    if (now() < start_deadline_) return;
    if (unsupervised() && start_attempts_ != 0) return run();
    if (++start_attempts_ <= max_starts) {
        send(NmtCommand::start);
        start_deadline_ = now() + start_limit();
        return;
    }
    status.cause = Cause::not_started;
    status.failed_in = Step::starting;
    cancel_work();
    react(setup.on_failure, setup.retry, BootStart::reset);
}

void Master::Node::run() noexcept {
    foreign_.command = 0;
    running_.since = now();
    running_.not_operational = 0;
    status.operational = unsupervised() || remote_.state() == NmtState::operational;
    running_.was_operational = status.operational;
    status.cause = Cause::none;
    master_.dirty_ = true;
    enter(Step::running);
}

void Master::Node::on_heartbeat(bool boot_up) noexcept {
    set_online();
    if (boot_up) return;
    if (booting()) return channel_.on_heartbeat();
    const bool operational = remote_.state() == NmtState::operational;
    switch (status.step) {
    case Step::starting:
        if (operational) {
            run();
        }
        return;
    case Step::stopped:
        if (operational && stop_command_ == NmtCommand::stop) {
            send(NmtCommand::stop);
        }
        return;
    case Step::failed:
        if (operational && master_.halted_) {
            send(NmtCommand::stop);
        }
        return;
    case Step::running: return watch_running(operational);
    default: return;
    }
}

void Master::Node::watch_running(bool operational) noexcept {
    set_operational(operational);
    if (operational) {
        running_.was_operational = true;
        running_.not_operational = 0;
        // A heartbeat that was queued before the foreign command may still report operational; a
        // later one shows that the command had no effect.
        if (now() - foreign_.at > supervision_.limit()) {
            foreign_.command = 0;
        }
    } else if (running_.was_operational && ++running_.not_operational == 2) {
        return lose(Cause::left_operational);  // a single one may be outdated
    }
    detect_duplicate();
}

/// Notes a second producer of the heartbeat: more than 16 heartbeats in ten periods.
void Master::Node::detect_duplicate() noexcept {
    const Time period = supervision_.producer_ms() * millisecond;
    const Time window = 10 * period;
    const bool known = (status.notes & note_duplicate_id) != 0;
    if (supervision_.guarding() || window == 0 || known) return;
    // After a pause of the master, queued heartbeats arrive all at once.
    const bool paused = now() - master_.polled_ > period;
    if (running_.heartbeats == 0 || paused || now() - running_.window_began >= window) {
        running_.heartbeats = 0;
        running_.window_began = now();
    }
    if (++running_.heartbeats <= 16) return;
    status.notes |= note_duplicate_id;
    master_.events_.on_step(status);
}

/// Remembers an NMT command of another device for the explanation of the state change that it
/// causes.
void Master::Node::on_foreign_command(std::uint8_t command) noexcept {
    const bool starts = command == static_cast<std::uint8_t>(NmtCommand::start);
    foreign_ = {starts ? std::uint8_t{0} : command, now()};
}

// Events.

void Master::Node::on_event(NodeEvent event) noexcept {
    refresh();
    switch (event) {
    case NodeEvent::lost: return on_lost();
    case NodeEvent::changed: return;
    case NodeEvent::boot_up: return on_boot_up();
    default:
        if (status.step == Step::waiting || status.step == Step::failed) {
            on_sign_of_life(BootStart::reset);
        }
        return;
    }
}

void Master::Node::on_lost() noexcept {
    status.online = false;
    master_.dirty_ = true;
    if (!is_started_or_ready()) return;
    if (remote_.toggle_stuck()) return lose(Cause::guard_toggle);
    lose(supervision_.guarding() ? Cause::guarding : Cause::heartbeat);
}

void Master::Node::on_boot_up() noexcept {
    switch (status.step) {
    case Step::waiting:
    case Step::failed: return on_sign_of_life(BootStart::booted);
    case Step::queued: next_start_ = BootStart::booted; return;
    case Step::resetting:
    case Step::updating: return channel_.on_boot_up();
    case Step::identifying:
    case Step::checking_state:
    case Step::checking_program:
    case Step::configuring:
    case Step::saving:
    case Step::watching: return reboot_while_booting();
    case Step::ready:
    case Step::starting:
    case Step::running: return lose(Cause::boot_up);
    default: return;
    }
}

void Master::Node::reboot_while_booting() noexcept {
    if (++reboots_ > max_reboots) {
        channel_.note_object(0, 0, 0, 0);
        return fail(letter_of_interrupted(status.step), Cause::restarting);
    }
    cancel_work();
    // Some nodes stay in initialising after a reset, and send that as their heartbeat, until they
    // receive an NMT command.
    if (reboots_ >= 2) {
        send(NmtCommand::enter_pre_operational);
    }
    boot_.begin_again();
}

// Failures and losses (CiA 302-2, figure 12).

void Master::Node::fail(BootResult result, Cause cause) noexcept {
    status.result = result;
    status.cause = cause;
    status.failed_in = status.step;
    cancel_work();
    if (is_silence(cause)) {
        status.online = false;
    }
    const bool absent = result == BootResult::no_answer &&
                        (cause == Cause::no_response || cause == Cause::not_sent);
    if (absent) return wait_for_absent();
    // A mismatching device is not reset: it may belong to another machine.
    const bool identifying = status.failed_in == Step::identifying;
    react(setup.on_failure, setup.retry,
          identifying ? BootStart::in_unknown_state : BootStart::reset);
}

/// CiA 302-2, figure 4, status B: asks again, a mandatory node until its boot timeout.
void Master::Node::wait_for_absent() noexcept {
    missing = true;
    if (!setup.mandatory) return react(Reaction::restart, setup.retry, BootStart::reset);
    if (now() - wanted_since_ >= setup.boot_limit) {
        return react(setup.on_failure, setup.retry, BootStart::reset);
    }
    status.next_try = now() + setup.retry;
    next_start_ = BootStart::reset;
    enter(Step::waiting);
}

void Master::Node::lose(Cause cause) noexcept {
    ++status.losses;
    status.cause = cause;
    status.failed_in = status.step;
    const bool by_command = cause == Cause::boot_up || cause == Cause::left_operational;
    status.foreign_command = by_command ? foreign_.command : std::uint8_t{0};
    channel_.note_object(0, 0, 0, 0);
    cancel_work();
    react(setup.on_loss, 0, cause == Cause::boot_up ? BootStart::booted : BootStart::reset);
}

void Master::Node::react(Reaction reaction, Time delay, BootStart how) noexcept {
    switch (reaction) {
    case Reaction::nothing: return enter(Step::failed);
    case Reaction::restart: return retry_after(std::max(delay, backoff_), how);
    case Reaction::stop_all: return master_.halt(NetworkState::failed, setup.id);
    case Reaction::reset_all: return master_.reset_all(setup.id);
    }
}

void Master::Node::retry_after(Time delay, BootStart how) noexcept {
    const Time max_backoff = std::max(setup.retry, setup.retry_max);
    backoff_ = backoff_ == 0 ? setup.retry : std::min(backoff_ * 2, max_backoff);
    status.next_try = now() + delay;
    next_start_ = delay != 0 && how == BootStart::booted ? BootStart::reset : how;
    enter(Step::waiting);
}

/// Boots a failed or waiting node as soon as it responds, instead of at the next retry, but not
/// more often than its retry interval.
void Master::Node::on_sign_of_life(BootStart how) noexcept {
    if (master_.halted_) return;
    const bool restarts = status.cause == Cause::restarting || status.cause == Cause::boot_up;
    const Time pause = restarts ? std::max(setup.retry, backoff_) : setup.retry;
    const Time at = std::max(now(), status.begun + pause);
    next_start_ = at == now() ? how : BootStart::reset;
    status.next_try = status.step == Step::failed ? at : std::min(status.next_try, at);
    enter(Step::waiting);
}

void Master::Node::command(NmtCommand command, bool sent_to_all) noexcept {
    const bool sends = command != NmtCommand::start && !sent_to_all;
    if (sends) {
        send(command);
    }
    switch (command) {
    case NmtCommand::start: {
        removed = false;
        const bool can_start = is_started_or_ready() || status.step == Step::stopped;
        if (canopen::booted(status.result) && can_start) return start(sent_to_all);
        if (!booting() && status.step != Step::queued) {
            leave(Step::queued, Cause::none);
            begin(BootStart::reset);
        }
        return;
    }
    case NmtCommand::stop:
    case NmtCommand::enter_pre_operational:
        leave(Step::stopped, Cause::commanded);
        stop_command_ = command;
        return;
    case NmtCommand::reset_node:
    case NmtCommand::reset_communication:
        leave(Step::queued, Cause::none);
        begin(BootStart::was_reset);
        return;
    }
}

}  // namespace hal::canopen
