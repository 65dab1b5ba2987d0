// SPDX-License-Identifier: MIT
// What a node does by itself, and what follows: its heartbeats and boot-up messages, failures, losses, reactions, commands.
#include <algorithm>

#include "boot_node.hpp"

namespace hal::canopen {

namespace {
constexpr unsigned most_reboots = 8;  // while it is booted
}  // namespace

void Master::Node::on_beat(bool boot_up) noexcept {
    missing = false;
    if (!status.online) status.online = true, master_.dirty_ = true;
    if (boot_up) return;
    ++beat_number_;
    const bool operational = remote_.state() == NmtState::operational;
    switch (status.step) {
    case Step::checking_state:
        if (task_ == Task::none) state_known(operational);
        return;
    case Step::watching:
        if (task_ == Task::none) watched();
        return;
    case Step::starting:
        if (operational) run();
        return;
    case Step::stopped:
        if (operational && held_by_ == NmtCommand::stop) master_.send(NmtCommand::stop, setup.id);
        return;
    case Step::failed:
        if (operational && master_.halted_) master_.send(NmtCommand::stop, setup.id);
        return;
    case Step::running: break;
    default: return;
    }
    if (status.operational != operational) status.operational = operational, master_.dirty_ = true;
    if (operational) was_operational_ = true, doubts_ = 0;
    else if (was_operational_ && ++doubts_ == 2) return lose(Cause::left_operational);  // one alone may be late
    const Time window = Time{10} * producer_ms_ * millisecond;
    if (guarding() || window == 0 || (status.notes & note_doubled) != 0) return;
    // After a pause the heartbeats of it come all at once.
    const bool paused = now() - master_.polled_ > producer_ms_ * millisecond;
    if (beats_ == 0 || paused || now() - beats_since_ >= window) beats_ = 0, beats_since_ = now();
    if (++beats_ <= 16) return;
    status.notes |= note_doubled;
    master_.events_.on_step(status);
}

void Master::Node::on_event(NodeEvent event) noexcept {
    refresh();
    if (event == NodeEvent::lost) {
        status.online = false;
        master_.dirty_ = true;
        if (status.step == Step::ready || status.step == Step::starting || status.step == Step::running)
            lose(remote_.toggle_stuck() ? Cause::guard_toggle : guarding() ? Cause::guarding : Cause::heartbeat);
        return;
    }
    if (event == NodeEvent::changed) return;
    const bool boot_up = event == NodeEvent::boot_up;
    switch (status.step) {
    case Step::waiting: case Step::failed: return came_back(boot_up ? How::booted : How::reset);
    case Step::queued:
        if (boot_up) how_ = How::booted;
        return;
    case Step::resetting:
        if (boot_up) state_known_ = true, identify();
        return;
    case Step::updating:
        if (boot_up && after_ == Task::launch) identify();
        return;
    case Step::identifying: case Step::checking_state: case Step::checking_program: case Step::configuring: case Step::saving:
    case Step::watching:
        if (boot_up) rebooted_while_booting();
        return;
    case Step::ready: case Step::starting: case Step::running:
        if (boot_up) lose(Cause::boot_up);
        return;
    default: return;
    }
}

void Master::Node::rebooted_while_booting() noexcept {
    if (++reboots_ > most_reboots) {
        about(0, 0);
        return fail(status.step == Step::identifying || status.step == Step::checking_state ? BootResult::no_answer
                    : status.step == Step::checking_program                                 ? BootResult::update
                    : status.step == Step::watching                                         ? BootResult::watching
                                                                                            : BootResult::configuration,
                    Cause::restarting);
    }
    drop();
    state_known_ = true;
    // Some stay initialising after a reset and send that as their heartbeat, until they are told to leave it.
    if (reboots_ >= 2) master_.send(NmtCommand::enter_pre_operational, setup.id);
    identify();
}

// Failing and trying again.

void Master::Node::about(std::uint16_t index, std::uint8_t sub, std::uint64_t expected, std::uint64_t found) noexcept {
    status.index = index, status.sub = sub;
    status.abort = Abort::none;
    status.expected = expected, status.found = found;
    status.write = 0;
}

void Master::Node::fail_transfer(BootResult result) noexcept {
    about_request(0, 0);
    status.abort = request_.abort;
    fail(result, request_.unsent                                 ? Cause::unsent
                 : silent()                                      ? Cause::silent
                 : lacks() && result == BootResult::no_program ? Cause::no_object : Cause::aborted);
}

void Master::Node::fail(BootResult result, Cause cause) noexcept {
    status.result = result;
    status.cause = cause;
    status.failed_in = status.step;
    drop();
    const bool absent = result == BootResult::no_answer && (cause == Cause::silent || cause == Cause::unsent);
    if (cause == Cause::silent || cause == Cause::heartbeat || cause == Cause::guarding) status.online = false;
    // A device that is not ours may go on with what it does.
    if (!absent) return react(setup.on_failure, setup.retry, status.failed_in == Step::identifying ? How::as_it_is : How::reset);
    missing = true;
    if (!setup.mandatory) return react(Reaction::restart, setup.retry, How::reset);
    if (now() - needed_since_ >= setup.boot_limit) return react(setup.on_failure, setup.retry, How::reset);
    status.next_try = now() + setup.retry;
    how_ = How::reset;
    enter(Step::waiting);
}

void Master::Node::lose(Cause cause) noexcept {
    ++status.losses;
    status.cause = cause;
    status.failed_in = status.step;
    about(0, 0);
    drop();
    react(setup.on_loss, 0, cause == Cause::boot_up ? How::booted : How::reset);
}

void Master::Node::react(Reaction reaction, Time delay, How how) noexcept {
    switch (reaction) {
    case Reaction::nothing: return enter(Step::failed);
    case Reaction::restart: return try_again(std::max(delay, backoff_), how);
    case Reaction::stop_all: return master_.halt(NetworkState::failed, setup.id);
    case Reaction::reset_all: return master_.reset_all(setup.id);
    }
}

void Master::Node::try_again(Time delay, How how) noexcept {
    backoff_ = backoff_ == 0 ? setup.retry : std::min(backoff_ * 2, std::max(setup.retry, setup.retry_most));
    status.next_try = now() + delay;
    how_ = delay != 0 && how == How::booted ? How::reset : how;
    enter(Step::waiting);
}

/// It gives a sign of life while it is given up or waited for: now rather than at the next try, but not again and again.
void Master::Node::came_back(How how) noexcept {
    if (master_.halted_) return;
    const auto pause = status.cause == Cause::restarting || status.cause == Cause::boot_up ? std::max(setup.retry, backoff_) : setup.retry;
    const auto at = std::max(now(), status.begun + pause);
    how_ = at == now() ? how : How::reset;
    status.next_try = status.step == Step::failed ? at : std::min(status.next_try, at);
    enter(Step::waiting);
}

bool Master::Node::command(NmtCommand command, bool told) noexcept {
    const bool booted_once = canopen::booted(status.result);
    switch (command) {
    case NmtCommand::start:
        removed = false;
        if (booted_once && (status.step == Step::stopped || (status.step >= Step::ready && status.step <= Step::running))) {
            start(told);
            return true;
        }
        if (!booting() && status.step != Step::queued) leave(Step::queued, Cause::none), begin(How::reset);
        return true;
    case NmtCommand::stop:
    case NmtCommand::enter_pre_operational:
        if (!told) master_.send(command, setup.id);
        leave(Step::stopped, Cause::commanded);
        held_by_ = command;
        return true;
    case NmtCommand::reset_node:
    case NmtCommand::reset_communication:
        if (!told) master_.send(command, setup.id);
        leave(Step::queued, Cause::none);
        begin(How::was_reset);
        return true;
    }
    return false;
}

}  // namespace hal::canopen
