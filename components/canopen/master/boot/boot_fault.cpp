// SPDX-License-Identifier: MIT
// Events of a node and their consequences: heartbeats and boot-up messages, failures, losses,
// reactions, commands.
#include <algorithm>

#include "boot_node.hpp"

namespace hal::canopen {

namespace {
constexpr unsigned max_reboots = 8;  // during one boot
}  // namespace

void Master::Node::on_heartbeat(bool boot_up) noexcept {
    missing = false;
    if (!status.online) {
        status.online = true;
        master_.dirty_ = true;
    }
    if (boot_up) return;
    ++heartbeats_;
    const bool operational = remote_.state() == NmtState::operational;
    switch (status.step) {
    case Step::checking_state:
        if (task_ == Task::none) {
            state_known(operational);
        }
        return;
    case Step::watching:
        if (task_ == Task::none) {
            supervised();
        }
        return;
    case Step::starting:
        if (operational) {
            run();
        }
        return;
    case Step::stopped:
        if (operational && stop_command_ == NmtCommand::stop) {
            master_.send(NmtCommand::stop, setup.id);
        }
        return;
    case Step::failed:
        if (operational && master_.halted_) {
            master_.send(NmtCommand::stop, setup.id);
        }
        return;
    case Step::running: break;
    default: return;
    }
    if (status.operational != operational) {
        status.operational = operational;
        master_.dirty_ = true;
    }
    // A heartbeat that was queued before the foreign command may still report operational; a later
    // one shows that the command had no effect.
    if (operational && foreign_command_ != 0 && now() - foreign_command_at_ > limit()) {
        foreign_command_ = 0;
    }
    if (operational) {
        was_operational_ = true;
        not_operational_ = 0;
    }
    // a single one may be outdated
    else if (was_operational_ && ++not_operational_ == 2) {
        return lose(Cause::left_operational);
    }
    const Time window = Time{10} * producer_ms_ * millisecond;
    if (guarding() || window == 0 || (status.notes & note_duplicate_id) != 0) return;
    // After a pause of the master, queued heartbeats arrive all at once.
    const bool paused = now() - master_.polled_ > producer_ms_ * millisecond;
    if (heartbeats_in_window_ == 0 || paused || now() - window_began_ >= window) {
        heartbeats_in_window_ = 0;
        window_began_ = now();
    }
    if (++heartbeats_in_window_ <= 16) return;
    status.notes |= note_duplicate_id;
    master_.events_.on_step(status);
}

/// Remembers an NMT command of another device for the explanation of the state change that it
/// causes.
void Master::Node::on_foreign_command(std::uint8_t command) noexcept {
    foreign_command_ =
        command == static_cast<std::uint8_t>(NmtCommand::start) ? std::uint8_t{0} : command;
    foreign_command_at_ = now();
}

void Master::Node::on_event(NodeEvent event) noexcept {
    refresh();
    if (event == NodeEvent::lost) {
        status.online = false;
        master_.dirty_ = true;
        if (status.step == Step::ready || status.step == Step::starting ||
            status.step == Step::running) {
            lose(remote_.toggle_stuck() ? Cause::guard_toggle
                 : guarding()           ? Cause::guarding
                                        : Cause::heartbeat);
        }
        return;
    }
    if (event == NodeEvent::changed) return;
    const bool boot_up = event == NodeEvent::boot_up;
    switch (status.step) {
    case Step::waiting:
    case Step::failed: return on_sign_of_life(boot_up ? How::booted : How::reset);
    case Step::queued:
        if (boot_up) {
            how_ = How::booted;
        }
        return;
    case Step::resetting:
        if (boot_up) {
            state_known_ = true;
            identify();
        }
        return;
    case Step::updating:
        if (boot_up && after_ == Task::launch) {
            identify();
        }
        return;
    case Step::identifying:
    case Step::checking_state:
    case Step::checking_program:
    case Step::configuring:
    case Step::saving:
    case Step::watching:
        if (boot_up) {
            rebooted_while_booting();
        }
        return;
    case Step::ready:
    case Step::starting:
    case Step::running:
        if (boot_up) {
            lose(Cause::boot_up);
        }
        return;
    default: return;
    }
}

void Master::Node::rebooted_while_booting() noexcept {
    if (++reboots_ > max_reboots) {
        note_object(0, 0);
        return fail(status.step == Step::identifying || status.step == Step::checking_state
                        ? BootResult::no_answer
                    : status.step == Step::checking_program ? BootResult::update
                    : status.step == Step::watching         ? BootResult::watching
                                                            : BootResult::configuration,
                    Cause::restarting);
    }
    cancel_work();
    state_known_ = true;
    // Some nodes stay in initialising after a reset, and send that as their heartbeat, until they
    // receive an NMT command.
    if (reboots_ >= 2) {
        master_.send(NmtCommand::enter_pre_operational, setup.id);
    }
    identify();
}

void Master::Node::note_object(std::uint16_t index, std::uint8_t sub, std::uint64_t expected,
                               std::uint64_t found) noexcept {
    status.index = index;
    status.sub = sub;
    status.abort = Abort::none;
    status.expected = expected;
    status.found = found;
    status.write = 0;
}

void Master::Node::fail_transfer(BootResult result) noexcept {
    note_request(0, 0);
    status.abort = request_.abort;
    fail(result, request_.not_sent                                      ? Cause::not_sent
                 : no_response()                                        ? Cause::no_response
                 : object_missing() && result == BootResult::no_program ? Cause::no_object
                                                                        : Cause::aborted);
}

void Master::Node::fail(BootResult result, Cause cause) noexcept {
    status.result = result;
    status.cause = cause;
    status.failed_in = status.step;
    cancel_work();
    const bool absent = result == BootResult::no_answer &&
                        (cause == Cause::no_response || cause == Cause::not_sent);
    if (cause == Cause::no_response || cause == Cause::heartbeat || cause == Cause::guarding) {
        status.online = false;
    }
    // A mismatching device is not reset: it may belong to another machine.
    if (!absent) {
        return react(setup.on_failure, setup.retry,
                     status.failed_in == Step::identifying ? How::in_unknown_state : How::reset);
    }
    missing = true;
    if (!setup.mandatory) return react(Reaction::restart, setup.retry, How::reset);
    if (now() - wanted_since_ >= setup.boot_limit) {
        return react(setup.on_failure, setup.retry, How::reset);
    }
    status.next_try = now() + setup.retry;
    how_ = How::reset;
    enter(Step::waiting);
}

void Master::Node::lose(Cause cause) noexcept {
    ++status.losses;
    status.cause = cause;
    status.failed_in = status.step;
    status.foreign_command = cause == Cause::boot_up || cause == Cause::left_operational
                                 ? foreign_command_
                                 : std::uint8_t{0};
    note_object(0, 0);
    cancel_work();
    react(setup.on_loss, 0, cause == Cause::boot_up ? How::booted : How::reset);
}

void Master::Node::react(Reaction reaction, Time delay, How how) noexcept {
    switch (reaction) {
    case Reaction::nothing: return enter(Step::failed);
    case Reaction::restart: return retry_after(std::max(delay, backoff_), how);
    case Reaction::stop_all: return master_.halt(NetworkState::failed, setup.id);
    case Reaction::reset_all: return master_.reset_all(setup.id);
    }
}

void Master::Node::retry_after(Time delay, How how) noexcept {
    backoff_ = backoff_ == 0 ? setup.retry
                             : std::min(backoff_ * 2, std::max(setup.retry, setup.retry_most));
    status.next_try = now() + delay;
    how_ = delay != 0 && how == How::booted ? How::reset : how;
    enter(Step::waiting);
}

/// Boots a failed or waiting node as soon as it responds, instead of at the next retry, but not
/// more often than its retry interval.
void Master::Node::on_sign_of_life(How how) noexcept {
    if (master_.halted_) return;
    const auto pause = status.cause == Cause::restarting || status.cause == Cause::boot_up
                           ? std::max(setup.retry, backoff_)
                           : setup.retry;
    const auto at = std::max(now(), status.begun + pause);
    how_ = at == now() ? how : How::reset;
    status.next_try = status.step == Step::failed ? at : std::min(status.next_try, at);
    enter(Step::waiting);
}

bool Master::Node::command(NmtCommand command, bool sent_to_all) noexcept {
    const bool booted_once = canopen::booted(status.result);
    switch (command) {
    case NmtCommand::start:
        removed = false;
        if (booted_once && (status.step == Step::stopped ||
                            (status.step >= Step::ready && status.step <= Step::running))) {
            start(sent_to_all);
            return true;
        }
        if (!booting() && status.step != Step::queued) {
            leave(Step::queued, Cause::none);
            begin(How::reset);
        }
        return true;
    case NmtCommand::stop:
    case NmtCommand::enter_pre_operational:
        if (!sent_to_all) {
            master_.send(command, setup.id);
        }
        leave(Step::stopped, Cause::commanded);
        stop_command_ = command;
        return true;
    case NmtCommand::reset_node:
    case NmtCommand::reset_communication:
        if (!sent_to_all) {
            master_.send(command, setup.id);
        }
        leave(Step::queued, Cause::none);
        begin(How::was_reset);
        return true;
    }
    return false;
}

}  // namespace hal::canopen
