// SPDX-License-Identifier: MIT
// The way of a node: reset, identity, state, then program (node_program.cpp) and configuration (node_configure.cpp), error control, start.
#include "boot_node.hpp"

#include <algorithm>
#include <string_view>

namespace hal::canopen {

namespace {

constexpr Time boot_up_wait = 1 * second;    // after a reset; a node that is silent for longer is asked all the same
constexpr Time second_answer = 20 * millisecond;  // within which another device with the same id answers, too
constexpr unsigned most_starts = 5;

struct Identity {
    std::uint16_t index;
    std::uint8_t sub;
    std::uint32_t NodeSetup::* wished;
    BootResult letter;
};
constexpr std::array<Identity, 5> identity_objects{{
    {0x1000, 0, &NodeSetup::device_type, BootResult::device_type},
    {0x1018, 1, &NodeSetup::vendor, BootResult::vendor},
    {0x1018, 2, &NodeSetup::product, BootResult::product},
    {0x1018, 3, &NodeSetup::revision, BootResult::revision},
    {0x1018, 4, &NodeSetup::serial, BootResult::serial},
}};

}  // namespace

Master::Node::Node(const NodeSetup& node_setup, RemoteNode& remote, Master& master) : setup(node_setup), remote_(remote), master_(master) {
    status.id = setup.id;
    status.mandatory = setup.mandatory;
    request_.context = this;
    request_.on_done = [](SdoRequest&, void* self) noexcept { static_cast<Node*>(self)->answered(); };
    make_groups();
    patience(0);
    if (setup.sdo_resends >= 0) remote_.sdo().settings().resends = static_cast<unsigned>(setup.sdo_resends);
    std::size_t longest = std::max<std::size_t>(64, setup.program.version.size() + 16);
    for (const auto& w : setup.writes) longest = std::max(longest, w.data.size() + 1);
    room_.resize(longest);
}

void Master::Node::enter(Step step) noexcept {
    if (step == status.step) return;
    const auto count = [&](int by) {
        if (booting()) master_.booting_ += static_cast<unsigned>(by);
        if (status.step == Step::ready) master_.ready_ += static_cast<unsigned>(by);
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

void Master::Node::drop() noexcept {
    task_ = Task::none;
    if (request_.status == SdoRequest::Status::waiting || request_.status == SdoRequest::Status::active) {
        const auto on_done = request_.on_done;
        request_.on_done = nullptr;
        remote_.sdo().cancel(request_, Abort::timeout);
        request_.on_done = on_done;
    }
    patience(0);
    unwatch();
    if (status.operational) status.operational = false, master_.dirty_ = true;
    was_operational_ = kept_ = false;
}

void Master::Node::unwatch() noexcept {
    remote_.expect_heartbeat(0);
    remote_.guard(0, 0, now());
}

/// Some answers take longer than usual: flash is written first. 0: as usual.
void Master::Node::patience(Time time) noexcept {
    remote_.sdo().settings().timeout = std::max(time, setup.sdo_timeout > 0 ? setup.sdo_timeout : master_.setup_.sdo.timeout);
}

void Master::Node::leave(Step step, Cause cause) noexcept {
    if (cause != Cause::none) status.cause = cause, status.failed_in = status.step;
    const bool was_watched = (status.step >= Step::ready && status.step <= Step::running) || status.step == Step::stopped;
    drop();
    if (step == Step::stopped) {
        held_by_ = NmtCommand::stop;
        if (was_watched) watch_on();
    }
    needed_since_ = -1;
    backoff_ = 0;
    missing = false;
    enter(step);
}

void Master::Node::begin(How how) noexcept {
    drop();
    ++status.attempts;
    status.begun = now();
    status.notes = 0;
    status.compared = status.written = 0;
    reboots_ = 0;
    restored_ = updated_ = state_known_ = told_pre_operational_ = again_ = skips_configuration_ = false;
    patience_ = 0;
    if (needed_since_ < 0) needed_since_ = now();
    how_ = how;
    const auto parallel = master_.setup_.parallel;
    if (parallel != 0 && master_.booting_ - (booting() ? 1U : 0U) >= parallel) return enter(Step::queued);
    go();
}

void Master::Node::go() noexcept {
    if (setup.keep_alive && how_ == How::reset && status.result == BootResult::none) how_ = How::as_it_is;
    switch (how_) {
    case How::reset: return reset(NmtCommand::reset_communication);
    case How::was_reset:
        deadline_ = now() + boot_up_wait;
        beat_before_ = beat_number_;
        return enter(Step::resetting);
    case How::booted: state_known_ = true; return identify();
    case How::as_it_is: return identify();
    }
}

void Master::Node::reset(NmtCommand command) noexcept {
    master_.send(command, setup.id);
    deadline_ = now() + boot_up_wait;
    beat_before_ = beat_number_;
    enter(Step::resetting);
}

void Master::Node::poll() noexcept {
    switch (status.step) {
    case Step::queued:
        if (master_.booting_ < master_.setup_.parallel || master_.setup_.parallel == 0) go();
        return;
    case Step::resetting:
        if (now() < deadline_) return;
        if (beat_number_ != beat_before_ && !again_) {  // it is there and was not reset: the command got lost
            again_ = true;
            return reset(restored_ ? NmtCommand::reset_node : NmtCommand::reset_communication);
        }
        return identify();
    case Step::identifying:
        if (mismatch_ != BootResult::none && now() >= deadline_) fail(mismatch_, Cause::differs);
        return;
    case Step::checking_state:
        if (task_ != Task::none || now() < deadline_) return;
        return setup.guard_ms != 0 ? fail(BootResult::no_guarding, Cause::guarding) : fail(BootResult::no_heartbeat, Cause::heartbeat);
    case Step::updating:
        if (task_ == Task::none && now() >= deadline_) flash_ready();
        return;
    case Step::watching:
        if (task_ != Task::none || now() < deadline_) return;
        return guarding() ? fail(BootResult::no_guarding, Cause::guarding) : fail(BootResult::watching, Cause::heartbeat);
    case Step::starting:
        if (now() < deadline_) return;
        if ((status.notes & note_unwatched) != 0 && tries_ != 0) return run();
        if (++tries_ <= most_starts) {
            master_.send(NmtCommand::start, setup.id);
            deadline_ = now() + std::max<Time>(limit(), 100 * millisecond);
            return;
        }
        status.cause = Cause::not_started, status.failed_in = Step::starting;
        drop();
        return react(setup.on_failure, setup.retry, How::reset);
    case Step::running:
        if (backoff_ != 0 && status.operational && now() - running_since_ >= setup.retry) backoff_ = 0;  // it has started well
        return;
    case Step::waiting:
        if (now() >= status.next_try) ++status.retries, begin(how_);
        return;
    default: return;
    }
}

// Asking.

void Master::Node::submit(Task task, std::uint16_t index, std::uint8_t sub) noexcept {
    task_ = task;
    request_.index = index, request_.sub = sub;
    remote_.sdo().submit(request_);
}
void Master::Node::read(Task task, std::uint16_t index, std::uint8_t sub) noexcept {
    request_.upload = true;
    request_.room = room_;
    submit(task, index, sub);
}
void Master::Node::write(Task task, std::uint16_t index, std::uint8_t sub, std::span<const std::uint8_t> data) noexcept {
    request_.upload = false;
    request_.data = data;
    submit(task, index, sub);
}
void Master::Node::write(Task task, std::uint16_t index, std::uint8_t sub, std::uint32_t value, unsigned size) noexcept {
    store(small_.data(), value);
    write(task, index, sub, std::span<const std::uint8_t>(small_).first(size));
}

std::uint64_t Master::Node::number() const noexcept {
    std::uint64_t value = 0;
    std::memcpy(&value, room_.data(), std::min<std::size_t>(request_.size, sizeof value));
    return value;
}

void Master::Node::answered() noexcept {
    status.sdo_retries += request_.retries;
    if (!silent()) {
        if (!status.online) status.online = true, master_.dirty_ = true;
        status.last_heard = now();
        missing = false;
    }
    const auto task = task_;
    task_ = Task::none;
    switch (task) {
    case Task::none: return;
    case Task::device_type: case Task::vendor: case Task::product: case Task::revision: case Task::serial: return identified();
    case Task::producer:
        if (silent()) return fail_transfer(status.step == Step::watching ? BootResult::watching : BootResult::no_heartbeat);
        producer_ms_ = ok() ? static_cast<std::uint16_t>(number()) : std::uint16_t{0};
        if (status.step == Step::watching) return await_beat();
        if (producer_ms_ == 0) return state_known(false);  // it says nothing, so it was not set up yet
        deadline_ = now() + limit() + 100 * millisecond;
        return;
    case Task::program_id:
        if (!ok()) return fail_transfer(BootResult::no_program);
        if (number() != setup.program.id) {
            about_request(setup.program.id, number());
            return program_differs();
        }
        if (!setup.program.version.empty()) return read(Task::program_version, 0x100a, 0);
        return program_right();
    case Task::program_version: {
        if (!ok()) return fail_transfer(BootResult::no_program);
        std::string_view found(reinterpret_cast<const char*>(room_.data()), request_.size);
        found = found.substr(0, found.find('\0'));
        if (found == setup.program.version) return program_right();
        about_request(0, 0);
        std::memcpy(&status.found, found.data(), std::min<std::size_t>(found.size(), 8));
        std::memcpy(&status.expected, setup.program.version.data(), std::min<std::size_t>(setup.program.version.size(), 8));
        return program_differs();
    }
    case Task::control_read: case Task::stop: case Task::erase: case Task::flash: case Task::download: case Task::launch:
        task_ = task;
        return update_answered();
    case Task::restore:
        if (!ok()) return fail_transfer(BootResult::configuration);
        restored_ = true;
        again_ = false;
        patience(0);
        return reset(NmtCommand::reset_node);
    case Task::date: case Task::time:
        if (silent()) return fail_transfer(BootResult::configuration);
        if (!ok()) status.notes |= note_no_date;
        if (!ok() || number() != (task == Task::date ? setup.configuration_date : setup.configuration_time)) return configure_anew();
        if (task == Task::date) return read(Task::time, 0x1020, 2);
        skips_configuration_ = true;
        return configure_from(own_group_);
    case Task::compare: return compared();
    case Task::write: return written();
    case Task::verify: return verified();
    case Task::consumer_count: case Task::consumer_entry:
        task_ = task;
        return consumer_answered();
    case Task::save:
        patience(0);
        return ok() ? watch() : fail_transfer(BootResult::configuration);
    }
}

// Identity.

void Master::Node::identify() noexcept {
    identity_known_ = 0;
    mismatch_ = BootResult::none;
    enter(Step::identifying);
    next_identity(0);
}

void Master::Node::next_identity(std::size_t from) noexcept {
    for (auto n = from; n < identity_objects.size(); ++n) {
        const auto& o = identity_objects[n];
        if (n != 0 && setup.*o.wished == 0) continue;  // 1000h is read in any case: is it there?
        asked_ = n;
        return read(static_cast<Task>(static_cast<std::size_t>(Task::device_type) + n), o.index, o.sub);
    }
    if (setup.keep_alive && !state_known_) return check_state();
    check_program();
}

void Master::Node::identified() noexcept {
    const auto& o = identity_objects[asked_];
    const auto wished = setup.*o.wished;
    if (silent()) {
        if (now() < patience_) return identify();
        return fail_transfer(BootResult::no_answer);
    }
    if (wished == 0) return next_identity(asked_ + 1);
    if (!ok()) return fail_transfer(o.letter);
    if (number() == wished) return next_identity(asked_ + 1);
    about_request(wished, number());
    mismatch_ = o.letter;
    deadline_ = now() + second_answer;
}

/// Two devices with one id answer both: what differs tells.
void Master::Node::on_sdo_frame(const Frame& f) noexcept {
    if (status.step < Step::identifying || !booting() || f.remote || f.length != 8 || (f.data[0] & 0xee) != 0x42) return;
    for (std::size_t n = 0; n < identity_objects.size(); ++n) {
        const auto& o = identity_objects[n];
        if (load<std::uint16_t>(f.data.data() + 1) != o.index || f.data[3] != o.sub) continue;
        const auto value = load<std::uint32_t>(f.data.data() + 4);
        if ((identity_known_ >> n & 1) != 0 && identity_[n] != value) {
            about(o.index, o.sub, identity_[n], value);
            return fail(o.letter, Cause::doubled);
        }
        identity_known_ |= 1U << n;
        identity_[n] = value;
    }
}

// Its state, where it may be left operational.

void Master::Node::check_state() noexcept {
    enter(Step::checking_state);
    if (setup.guard_ms == 0) return read(Task::producer, 0x1017, 0);
    remote_.guard(guard_period(), setup.guard_factor, now());
    deadline_ = now() + guard_period() * setup.guard_factor;
}

void Master::Node::state_known(bool operational) noexcept {
    state_known_ = true;
    if (!operational) return check_program();
    kept_ = true;
    status.notes |= note_kept;
    watch();
}

// Error control.

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
    if (!setup.watched()) return await_beat();
    if (producer_ms_ == 0 || kept_ || !setup.configure) return read(Task::producer, 0x1017, 0);
    await_beat();
}

void Master::Node::await_beat() noexcept {
    if (!setup.watched() || (producer_ms_ == 0 && setup.heartbeat_limit == 0)) {
        status.notes |= note_unwatched;
        return booted(kept_ ? BootResult::was_operational : BootResult::good);
    }
    deadline_ = now() + limit() + 100 * millisecond;
}

/// As it was watched before.
void Master::Node::watch_on() noexcept {
    if (guarding()) remote_.guard(guard_period(), setup.guard_factor, now());
    else if ((status.notes & note_unwatched) == 0) remote_.expect_heartbeat(limit());
}

void Master::Node::watched() noexcept {
    if (!guarding()) watch_on();
    booted(kept_ ? BootResult::was_operational : BootResult::good);
}

void Master::Node::booted(BootResult result) noexcept {
    status.result = result;
    status.cause = Cause::none;
    status.booted = now();
    needed_since_ = -1;
    beats_ = 0;
    if (kept_ || !setup.start) return run();
    enter(Step::ready);
}

void Master::Node::start(bool told) noexcept {
    tries_ = 0;
    if (!told) master_.send(NmtCommand::start, setup.id);
    deadline_ = now() + std::max<Time>(limit(), 100 * millisecond);
    enter(Step::starting);
}

void Master::Node::run() noexcept {
    running_since_ = now();
    doubts_ = 0;
    const bool known = (status.notes & note_unwatched) == 0;
    status.operational = known ? remote_.state() == NmtState::operational : true;
    was_operational_ = status.operational;
    status.cause = Cause::none;
    master_.dirty_ = true;
    enter(Step::running);
}

}  // namespace hal::canopen
