// SPDX-License-Identifier: MIT
// The boot procedure of a node (CiA 302-2): reset, identity (boot_identity.cpp), program
// (boot_program.cpp), configuration (boot_configure.cpp), error control, start.
#include "boot_node.hpp"

#include <algorithm>
#include <string_view>

namespace hal::canopen {

namespace {
// after a reset; then the node is identified even without a boot-up message
constexpr Time boot_up_wait = 1 * second;
constexpr unsigned max_starts = 5;
}  // namespace

Master::Node::Node(const NodeSetup& node_setup, RemoteNode& remote, Master& master)
    : setup(node_setup), remote_(remote), master_(master) {
    status.id = setup.id;
    status.mandatory = setup.mandatory;
    request_.context = this;
    request_.on_done = [](SdoRequest&, void* self) noexcept {
        static_cast<Node*>(self)->answered();
    };
    make_groups();
    set_sdo_timeout(0);
    if (setup.sdo_resends >= 0) {
        remote_.sdo().settings().resends = static_cast<unsigned>(setup.sdo_resends);
    }
    std::size_t longest = std::max<std::size_t>(64, setup.program.version.size() + 16);
    for (const auto& w : setup.writes) {
        longest = std::max(longest, w.data.size() + 1);
    }
    buffer_.resize(longest);
}

void Master::Node::enter(Step step) noexcept {
    if (step == status.step) return;
    const auto count = [&](int by) {
        if (booting()) {
            master_.booting_ += static_cast<unsigned>(by);
        }
        if (status.step == Step::ready) {
            master_.ready_ += static_cast<unsigned>(by);
        }
    };
    count(-1);
    status.step = step;
    count(1);
    master_.dirty_ = true;
    refresh();
    master_.events_.on_step(status);
}

void Master::Node::refresh() noexcept {
    status.state = remote_.state();
    status.boot_ups = remote_.boot_ups();
    status.wrong_toggles = remote_.wrong_toggles();
    status.emergencies = remote_.emergencies();
    status.emergency = remote_.emergency(0);
    status.error_register = remote_.error_register();
    status.last_heard = std::max(status.last_heard, remote_.last_heard());
}

void Master::Node::cancel_work() noexcept {
    task_ = Task::none;
    if (request_.status == SdoRequest::Status::waiting ||
        request_.status == SdoRequest::Status::active) {
        const auto on_done = request_.on_done;
        request_.on_done = nullptr;
        remote_.sdo().cancel(request_, Abort::timeout);
        request_.on_done = on_done;
    }
    set_sdo_timeout(0);
    stop_supervision();
    if (status.operational) {
        status.operational = false;
        master_.dirty_ = true;
    }
    was_operational_ = left_running_ = false;
}

void Master::Node::stop_supervision() noexcept {
    remote_.expect_heartbeat(0);
    remote_.guard(0, 0, now());
}

/// Sets the SDO timeout for requests that take longer, such as writes to flash; 0: the configured
/// timeout.
void Master::Node::set_sdo_timeout(Time time) noexcept {
    remote_.sdo().settings().timeout =
        std::max(time, setup.sdo_timeout > 0 ? setup.sdo_timeout : master_.setup_.sdo.timeout);
}

void Master::Node::leave(Step step, Cause cause) noexcept {
    if (cause != Cause::none) {
        status.cause = cause;
        status.failed_in = status.step;
    }
    const bool was_watched = (status.step >= Step::ready && status.step <= Step::running) ||
                             status.step == Step::stopped;
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

void Master::Node::begin(How how) noexcept {
    cancel_work();
    ++status.attempts;
    status.begun = now();
    status.notes = 0;
    status.compared = status.written = 0;
    reboots_ = 0;
    foreign_command_ = 0;
    restored_ = updated_ = state_known_ = sent_pre_operational_ = again_ = configuration_current_ =
        false;
    answer_deadline_ = 0;
    if (wanted_since_ < 0) {
        wanted_since_ = now();
    }
    how_ = how;
    const auto parallel = master_.setup_.parallel;
    if (parallel != 0 && master_.booting_ - (booting() ? 1U : 0U) >= parallel) {
        return enter(Step::queued);
    }
    begin_now();
}

void Master::Node::begin_now() noexcept {
    if (setup.keep_alive && how_ == How::reset && status.result == BootResult::none) {
        how_ = How::in_unknown_state;
    }
    switch (how_) {
    case How::reset: return reset(NmtCommand::reset_communication);
    case How::was_reset:
        deadline_ = now() + boot_up_wait;
        heartbeats_before_ = heartbeats_;
        return enter(Step::resetting);
    case How::booted: state_known_ = true; return identify();
    case How::in_unknown_state: return identify();
    }
}

void Master::Node::reset(NmtCommand command) noexcept {
    master_.send(command, setup.id);
    deadline_ = now() + boot_up_wait;
    heartbeats_before_ = heartbeats_;
    enter(Step::resetting);
}

void Master::Node::poll() noexcept {
    switch (status.step) {
    case Step::queued:
        if (master_.booting_ < master_.setup_.parallel || master_.setup_.parallel == 0) {
            begin_now();
        }
        return;
    case Step::resetting:
        if (now() < deadline_) return;
        // the node is alive and was not reset: the command was lost
        if (heartbeats_ != heartbeats_before_ && !again_) {
            again_ = true;
            return reset(restored_ ? NmtCommand::reset_node : NmtCommand::reset_communication);
        }
        return identify();
    case Step::identifying:
        if (mismatch_ != BootResult::none && now() >= deadline_) {
            fail(mismatch_, Cause::mismatch);
        }
        return;
    case Step::checking_state:
        if (task_ != Task::none || now() < deadline_) return;
        return setup.guard_ms != 0 ? fail(BootResult::no_guarding, Cause::guarding)
                                   : fail(BootResult::no_heartbeat, Cause::heartbeat);
    case Step::updating:
        if (task_ == Task::none && now() >= deadline_) {
            flash_ready();
        }
        return;
    case Step::watching:
        if (task_ != Task::none || now() < deadline_) return;
        return guarding() ? fail(BootResult::no_guarding, Cause::guarding)
                          : fail(BootResult::watching, Cause::heartbeat);
    case Step::starting:
        if (now() < deadline_) return;
        if ((status.notes & note_unsupervised) != 0 && start_attempts_ != 0) return run();
        if (++start_attempts_ <= max_starts) {
            master_.send(NmtCommand::start, setup.id);
            deadline_ = now() + std::max<Time>(limit(), 100 * millisecond);
            return;
        }
        status.cause = Cause::not_started;
        status.failed_in = Step::starting;
        cancel_work();
        return react(setup.on_failure, setup.retry, How::reset);
    case Step::running:
        // stable since its start
        if (backoff_ != 0 && status.operational && now() - running_since_ >= setup.retry) {
            backoff_ = 0;
        }
        return;
    case Step::waiting:
        if (now() >= status.next_try) {
            ++status.retries;
            begin(how_);
        }
        return;
    default: return;
    }
}

void Master::Node::submit(Task task, std::uint16_t index, std::uint8_t sub) noexcept {
    task_ = task;
    request_.index = index;
    request_.sub = sub;
    remote_.sdo().submit(request_);
}
void Master::Node::read(Task task, std::uint16_t index, std::uint8_t sub) noexcept {
    request_.upload = true;
    request_.buffer = buffer_;
    submit(task, index, sub);
}
void Master::Node::write(Task task, std::uint16_t index, std::uint8_t sub,
                         std::span<const std::uint8_t> data) noexcept {
    request_.upload = false;
    request_.data = data;
    submit(task, index, sub);
}
void Master::Node::write(Task task, std::uint16_t index, std::uint8_t sub, std::uint32_t value,
                         unsigned size) noexcept {
    store(small_.data(), value);
    write(task, index, sub, std::span<const std::uint8_t>(small_).first(size));
}

std::uint64_t Master::Node::number() const noexcept {
    std::uint64_t value = 0;
    std::memcpy(&value, buffer_.data(), std::min<std::size_t>(request_.size, sizeof value));
    return value;
}

void Master::Node::producer_answered() noexcept {
    const bool is_watching = status.step == Step::watching;
    if (no_response()) {
        return fail_transfer(is_watching ? BootResult::watching : BootResult::no_heartbeat);
    }
    producer_ms_ = ok() ? static_cast<std::uint16_t>(number()) : std::uint16_t{0};
    if (is_watching) return await_heartbeat();
    if (producer_ms_ == 0) return state_known(false);  // no heartbeat, so it was not configured yet
    deadline_ = now() + limit() + 100 * millisecond;
}

void Master::Node::program_id_answered() noexcept {
    if (!ok()) return fail_transfer(BootResult::no_program);
    if (number() != setup.program.id) {
        note_request(setup.program.id, number());
        return program_differs();
    }
    if (!setup.program.version.empty()) return read(Task::program_version, 0x100a, 0);
    program_right();
}

void Master::Node::program_version_answered() noexcept {
    if (!ok()) return fail_transfer(BootResult::no_program);
    const std::string& expected = setup.program.version;
    std::string_view found(reinterpret_cast<const char*>(buffer_.data()), request_.size);
    found = found.substr(0, found.find('\0'));
    if (found == expected) return program_right();
    note_request(0, 0);
    std::memcpy(&status.found, found.data(), std::min<std::size_t>(found.size(), 8));
    std::memcpy(&status.expected, expected.data(), std::min<std::size_t>(expected.size(), 8));
    program_differs();
}

void Master::Node::restore_answered() noexcept {
    if (!ok()) return fail_transfer(BootResult::configuration);
    restored_ = true;
    again_ = false;
    set_sdo_timeout(0);
    reset(NmtCommand::reset_node);
}

/// 1020h, date and time of the node's configuration.
void Master::Node::date_answered(Task task) noexcept {
    if (no_response()) return fail_transfer(BootResult::configuration);
    const bool is_date = task == Task::date;
    const auto expected = is_date ? setup.configuration_date : setup.configuration_time;
    if (!ok()) {
        status.notes |= note_no_date;
    }
    if (!ok() || number() != expected) return configure_anew();
    if (is_date) return read(Task::time, 0x1020, 2);
    configuration_current_ = true;
    configure_from(own_group_);
}

void Master::Node::save_answered() noexcept {
    set_sdo_timeout(0);
    if (!ok()) return fail_transfer(BootResult::configuration);
    watch();
}

void Master::Node::heard_by_sdo() noexcept {
    if (!status.online) {
        status.online = true;
        master_.dirty_ = true;
    }
    status.last_heard = now();
    missing = false;
}

void Master::Node::answered() noexcept {
    status.sdo_retries += request_.retries;
    if (!no_response()) {
        heard_by_sdo();
    }
    const auto task = task_;
    task_ = Task::none;
    switch (task) {
    case Task::none: return;
    case Task::device_type:
    case Task::vendor:
    case Task::product:
    case Task::revision:
    case Task::serial: return identified();
    case Task::producer: return producer_answered();
    case Task::program_id: return program_id_answered();
    case Task::program_version: return program_version_answered();
    case Task::control_read:
    case Task::stop:
    case Task::erase:
    case Task::flash:
    case Task::download:
    case Task::launch: task_ = task; return update_answered();
    case Task::restore: return restore_answered();
    case Task::date:
    case Task::time: return date_answered(task);
    case Task::compare: return compared();
    case Task::write: return written();
    case Task::verify: return verified();
    case Task::consumer_count:
    case Task::consumer_entry: task_ = task; return consumer_answered();
    case Task::save: return save_answered();
    }
}

void Master::Node::check_state() noexcept {
    enter(Step::checking_state);
    if (setup.guard_ms == 0) return read(Task::producer, 0x1017, 0);
    remote_.guard(guard_period(), setup.guard_factor, now());
    deadline_ = now() + guard_period() * setup.guard_factor;
}

void Master::Node::state_known(bool operational) noexcept {
    state_known_ = true;
    if (!operational) return check_program();
    left_running_ = true;
    status.notes |= note_kept;
    watch();
}

Time Master::Node::limit() const noexcept {
    if (guarding()) return guard_period() * 2;
    if (setup.heartbeat_limit > 0) return setup.heartbeat_limit;
    return producer_ms_ * millisecond * 5 / 2;
}

void Master::Node::watch() noexcept {
    enter(Step::watching);
    if (guarding()) {
        remote_.guard(guard_period(), setup.guard_factor, now());
        deadline_ = now() + guard_period() * setup.guard_factor;
        return;
    }
    if (!setup.supervised()) return await_heartbeat();
    if (producer_ms_ == 0 || left_running_ || !setup.configure) {
        return read(Task::producer, 0x1017, 0);
    }
    await_heartbeat();
}

void Master::Node::await_heartbeat() noexcept {
    if (!setup.supervised() || (producer_ms_ == 0 && setup.heartbeat_limit == 0)) {
        status.notes |= note_unsupervised;
        return booted(left_running_ ? BootResult::was_operational : BootResult::good);
    }
    deadline_ = now() + limit() + 100 * millisecond;
}

/// Resumes the previous supervision.
void Master::Node::resume_supervision() noexcept {
    if (guarding()) {
        remote_.guard(guard_period(), setup.guard_factor, now());
    } else if ((status.notes & note_unsupervised) == 0) {
        remote_.expect_heartbeat(limit());
    }
}

void Master::Node::supervised() noexcept {
    if (!guarding()) {
        resume_supervision();
    }
    booted(left_running_ ? BootResult::was_operational : BootResult::good);
}

void Master::Node::booted(BootResult result) noexcept {
    status.result = result;
    status.cause = Cause::none;
    status.booted = now();
    wanted_since_ = -1;
    heartbeats_in_window_ = 0;
    if (left_running_ || !setup.start) return run();
    enter(Step::ready);
}

void Master::Node::start(bool sent_to_all) noexcept {
    start_attempts_ = 0;
    if (!sent_to_all) {
        master_.send(NmtCommand::start, setup.id);
    }
    deadline_ = now() + std::max<Time>(limit(), 100 * millisecond);
    enter(Step::starting);
}

void Master::Node::run() noexcept {
    foreign_command_ = 0;
    running_since_ = now();
    not_operational_ = 0;
    const bool known = (status.notes & note_unsupervised) == 0;
    status.operational = known ? remote_.state() == NmtState::operational : true;
    was_operational_ = status.operational;
    status.cause = Cause::none;
    master_.dirty_ = true;
    enter(Step::running);
}

}  // namespace hal::canopen
