// SPDX-License-Identifier: MIT
// Checks the identity of a node, 1000h and 1018h, against the set-up (CiA 302-2), and detects
// duplicate node IDs.
#include "boot_node.hpp"

namespace hal::canopen {

namespace {

// in which a second device with the same node ID responds as well
constexpr Time second_answer = 20 * millisecond;

struct Identity {
    std::uint16_t index;
    std::uint8_t sub;
    std::uint32_t NodeSetup::* expected;
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

void Master::Node::identify() noexcept {
    identity_known_ = 0;
    mismatch_ = BootResult::none;
    enter(Step::identifying);
    next_identity(0);
}

void Master::Node::next_identity(std::size_t from) noexcept {
    for (auto n = from; n < identity_objects.size(); ++n) {
        const auto& o = identity_objects[n];
        // 1000h is always read, to find out whether the node responds
        if (n != 0 && setup.*o.expected == 0) continue;
        asked_ = n;
        return read(static_cast<Task>(static_cast<std::size_t>(Task::device_type) + n), o.index,
                    o.sub);
    }
    if (setup.keep_alive && !state_known_) return check_state();
    check_program();
}

void Master::Node::identified() noexcept {
    const auto& o = identity_objects[asked_];
    const auto expected = setup.*o.expected;
    if (no_response()) {
        if (now() < answer_deadline_) return identify();
        return fail_transfer(BootResult::no_answer);
    }
    if (expected == 0) return next_identity(asked_ + 1);
    if (!ok()) return fail_transfer(o.letter);
    if (number() == expected) return next_identity(asked_ + 1);
    note_request(expected, number());
    mismatch_ = o.letter;
    deadline_ = now() + second_answer;
}

/// Detects two devices with the same node ID: their responses to one request differ.
void Master::Node::on_sdo_frame(const Frame& f) noexcept {
    if (status.step < Step::identifying || !booting() || f.remote || f.length != 8 ||
        (f.data[0] & 0xee) != 0x42) {
        return;
    }
    for (std::size_t n = 0; n < identity_objects.size(); ++n) {
        const auto& o = identity_objects[n];
        if (load<std::uint16_t>(f.data.data() + 1) != o.index || f.data[3] != o.sub) continue;
        const auto value = load<std::uint32_t>(f.data.data() + 4);
        if ((identity_known_ >> n & 1) != 0 && identity_[n] != value) {
            note_object(o.index, o.sub, identity_[n], value);
            return fail(o.letter, Cause::duplicate_id);
        }
        identity_known_ |= 1U << n;
        identity_[n] = value;
    }
}

}  // namespace hal::canopen
