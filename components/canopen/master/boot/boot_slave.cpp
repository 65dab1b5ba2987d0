// SPDX-License-Identifier: MIT
#include "boot_slave.hpp"

#include "program_download.hpp"

namespace hal::canopen {

namespace {

// after a reset; then the node is identified even without a boot-up message
constexpr Time boot_up_wait = 1 * second;
// in which a second device with the same node ID responds as well
constexpr Time second_answer = 20 * millisecond;
// beside its period, for the first heartbeat
constexpr Time heartbeat_tolerance = 100 * millisecond;

struct IdentityObject {
    std::uint16_t index;
    std::uint8_t sub;
    std::uint32_t NodeSetup::* expected;
    BootResult letter;
};
constexpr std::array<IdentityObject, 5> identity_objects{{
    {0x1000, 0, &NodeSetup::device_type, BootResult::device_type},
    {0x1018, 1, &NodeSetup::vendor, BootResult::vendor},
    {0x1018, 2, &NodeSetup::product, BootResult::product},
    {0x1018, 3, &NodeSetup::revision, BootResult::revision},
    {0x1018, 4, &NodeSetup::serial, BootResult::serial},
}};

}  // namespace

BootSlave::BootSlave(BootChannel& channel, NodeSupervision& supervision, std::uint8_t master_id)
    : channel_(channel),
      supervision_(supervision),
      configuration_(channel.setup, master_id, supervision) {}

void BootSlave::begin(BootStart how) noexcept {
    state_known_ = downloaded_ = restored_ = false;
    answer_by_ = 0;
    channel_.start([&] { return boot(channel_, how); });
}

void BootSlave::begin_again() noexcept {
    state_known_ = true;
    channel_.start([&] { return boot_from_identity(channel_); });
}

Task<> BootSlave::boot(BootChannel& node, BootStart how) noexcept {
    switch (how) {
    case BootStart::reset: co_await reset(node, NmtCommand::reset_communication, false); break;
    case BootStart::was_reset: co_await reset(node, NmtCommand::reset_communication, true); break;
    case BootStart::booted: state_known_ = true; break;
    case BootStart::in_unknown_state: break;
    }
    co_await boot_from_identity(node);
}

/// CiA 302-2, figure 4: the path from the identification on.
Task<> BootSlave::boot_from_identity(BootChannel& node) noexcept {
    for (;;) {
        const bool identified = co_await identify(node);
        if (!identified) co_return;

        bool kept = false;
        if (node.setup.keep_alive && !state_known_) {  // connector B
            const State state = co_await check_state(node);
            if (state == State::failed) co_return;
            kept = state == State::operational;
        }
        if (!kept) {  // connector C
            const Prepared prepared = co_await prepare(node);
            if (prepared == Prepared::failed) co_return;
            if (prepared == Prepared::restarting) continue;
        }
        co_await start_error_control(node, kept);  // connector D
        co_return;
    }
}

/// CiA 302-2, figure 6: resets the node and waits for its boot-up message. A node that sends
/// heartbeats instead did not get the command; it is sent once more.
Task<> BootSlave::reset(BootChannel& node, NmtCommand command, bool already_sent) noexcept {
    if (!already_sent) {
        node.send(command);
    }
    for (unsigned tries = 0; tries < 2; ++tries) {
        const std::uint64_t heartbeats = node.heartbeats();
        const Time until = node.now() + boot_up_wait;
        node.enter(Step::resetting);
        const bool booted = co_await node.boot_up(until);
        if (booted) {
            state_known_ = true;
            co_return;
        }
        if (tries != 0 || node.heartbeats() == heartbeats) co_return;
        node.send(command);
    }
}

/// CiA 302-2, figure 5: checks device type and identity. While the node starts a new program, it is
/// asked again.
Task<bool> BootSlave::identify(BootChannel& node) noexcept {
    for (;;) {
        answered_ = 0;
        node.enter(Step::identifying);
        const Identity identity = co_await read_identity(node);
        if (identity != Identity::no_response) co_return identity == Identity::expected;
        if (node.now() >= answer_by_) co_return node.fail_transfer(BootResult::no_answer);
    }
}

Task<BootSlave::Identity> BootSlave::read_identity(BootChannel& node) noexcept {
    for (std::size_t n = 0; n < identity_objects.size(); ++n) {
        const IdentityObject& object = identity_objects[n];
        const std::uint32_t expected = node.setup.*object.expected;
        // 1000h is always read, to find out whether the node responds
        if (n != 0 && expected == 0) continue;
        const SdoAnswer answer = co_await node.read(object.index, object.sub);
        if (answer.no_response()) co_return Identity::no_response;
        if (expected == 0) continue;
        if (!answer.ok()) {
            node.fail_transfer(object.letter);
            co_return Identity::failed;
        }
        if (answer.number() == expected) continue;
        node.note_answer(expected, answer.number());
        co_await node.sleep_until(node.now() + second_answer);
        node.fail(object.letter, Cause::mismatch);
        co_return Identity::failed;
    }
    co_return Identity::expected;
}

/// CiA 302-2, figure 6, connector B: the state of a node that may be operational already, by its
/// heartbeat or its guarding response.
Task<BootSlave::State> BootSlave::check_state(BootChannel& node) noexcept {
    node.enter(Step::checking_state);
    Time until = 0;
    if (node.setup.guard_ms != 0) {
        until = supervision_.guard(node.now());
    } else {
        const bool known = co_await read_producer(node, BootResult::no_heartbeat);
        if (!known) co_return State::failed;
        if (supervision_.producer_ms() == 0) {
            state_known_ = true;
            co_return State::other;  // no heartbeat, so it was not configured yet
        }
        until = node.now() + supervision_.limit() + heartbeat_tolerance;
    }
    const bool heard = co_await node.heartbeat(until);
    if (!heard) {
        if (node.setup.guard_ms != 0) {
            node.fail(BootResult::no_guarding, Cause::guarding);
        } else {
            node.fail(BootResult::no_heartbeat, Cause::heartbeat);
        }
        co_return State::failed;
    }
    state_known_ = true;
    co_return node.remote.state() == NmtState::operational ? State::operational : State::other;
}

Task<bool> BootSlave::read_producer(BootChannel& node, BootResult letter) noexcept {
    const SdoAnswer answer = co_await node.read(0x1017, 0);
    if (answer.no_response()) co_return node.fail_transfer(letter);
    supervision_.set_producer(answer.ok() ? static_cast<std::uint16_t>(answer.number())
                                          : std::uint16_t{0});
    co_return true;
}

/// CiA 302-2, figure 8, connector C: program and configuration.
Task<BootSlave::Prepared> BootSlave::prepare(BootChannel& node) noexcept {
    const ProgramCheck program = co_await check_program(node, downloaded_);
    if (program == ProgramCheck::failed) co_return Prepared::failed;
    if (program == ProgramCheck::replaced) {
        downloaded_ = true;
        answer_by_ = node.now() + node.setup.program.limit;
        co_await node.boot_up(node.now() + 1 * second);
        co_return Prepared::restarting;
    }

    if (!node.setup.configure) co_return Prepared::done;
    using Configuration = ConfigurationDownload::Result;
    const Configuration configuration = co_await configuration_.run(node, restored_);
    if (configuration == Configuration::failed) co_return Prepared::failed;
    if (configuration == Configuration::done) co_return Prepared::done;
    restored_ = true;
    co_await reset(node, NmtCommand::reset_node, false);
    co_return Prepared::restarting;
}

/// CiA 302-2, figure 11, connector D: the error control service. `kept`: the node was operational
/// before the boot and goes on, letter L.
Task<> BootSlave::start_error_control(BootChannel& node, bool kept) noexcept {
    if (kept) {
        node.status.notes |= note_kept;
    }
    node.enter(Step::watching);
    const bool heard = co_await await_first_heartbeat(node, kept);
    if (heard) {
        node.succeed(kept ? BootResult::was_operational : BootResult::good);
    }
}

Task<bool> BootSlave::await_first_heartbeat(BootChannel& node, bool kept) noexcept {
    if (supervision_.guarding()) {
        const bool heard = co_await node.heartbeat(supervision_.guard(node.now()));
        if (heard) co_return true;
        co_return node.fail(BootResult::no_guarding, Cause::guarding);
    }
    const bool supervised = node.setup.supervised();
    const bool is_read = supervision_.producer_ms() == 0 || kept || !node.setup.configure;
    if (supervised && is_read) {
        const bool known = co_await read_producer(node, BootResult::watching);
        if (!known) co_return false;
    }
    if (!supervised || !supervision_.has_heartbeat()) {
        node.status.notes |= note_unsupervised;
        co_return true;
    }
    const bool heard =
        co_await node.heartbeat(node.now() + supervision_.limit() + heartbeat_tolerance);
    if (!heard) co_return node.fail(BootResult::watching, Cause::heartbeat);
    supervision_.expect_heartbeat();
    co_return true;
}

std::optional<BootSlave::Contradiction> BootSlave::on_sdo_frame(const Frame& f) noexcept {
    const bool is_expedited_upload = !f.remote && f.length == 8 && (f.data[0] & 0xee) == 0x42;
    if (!is_expedited_upload) return {};
    for (std::size_t n = 0; n < identity_objects.size(); ++n) {
        const IdentityObject& o = identity_objects[n];
        if (load<std::uint16_t>(f.data.data() + 1) != o.index || f.data[3] != o.sub) continue;
        const auto value = load<std::uint32_t>(f.data.data() + 4);
        if ((answered_ >> n & 1) != 0 && answers_[n] != value) {
            return Contradiction{o.letter, o.index, o.sub, answers_[n], value};
        }
        answered_ |= 1U << n;
        answers_[n] = value;
    }
    return {};
}

}  // namespace hal::canopen
