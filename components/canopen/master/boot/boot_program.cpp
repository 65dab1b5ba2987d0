// SPDX-License-Identifier: MIT
// The program of a node (CiA 302-3): checks it and, if it differs, stops, erases, downloads and
// starts it.
#include <algorithm>

#include "boot_node.hpp"

namespace hal::canopen {

namespace {
constexpr std::uint8_t stop_program = 0;
constexpr std::uint8_t start_program = 1;
constexpr std::uint8_t clear_program = 3;
constexpr Time flash_poll_interval = 100 * millisecond;  // of 1F57h
constexpr std::uint64_t flash_busy = 1;
constexpr std::uint64_t flash_error = 0xfe;
constexpr std::uint64_t no_valid_program = 1 << 1;
}  // namespace

void Master::Node::check_program() noexcept {
    if (!setup.program.checked()) return configure();
    enter(Step::checking_program);
    if (setup.program.id != 0) return read(Task::program_id, 0x1f56, setup.program.number);
    read(Task::program_version, 0x100a, 0);
}

void Master::Node::program_right() noexcept { configure(); }

void Master::Node::program_differs() noexcept {
    if (updated_) return fail(BootResult::update, Cause::not_retained);
    if (!setup.program.update) return fail(BootResult::no_update, Cause::mismatch);
    if (setup.program.image.empty()) return fail(BootResult::no_program, Cause::no_image);
    update();
}

void Master::Node::update() noexcept {
    after_ = Task::none;
    enter(Step::updating);
    read(Task::control_read, 0x1f51, setup.program.number);
}

/// Polls the flash status until it is ready for the step after `after`. No response means that the
/// node is busy or restarts.
void Master::Node::await_flash(Task after) noexcept {
    after_ = after;
    set_sdo_timeout(0);
    answer_deadline_ = now() + setup.program.limit;
    deadline_ = now();
}

void Master::Node::update_answered() noexcept {
    const auto number_of = setup.program.number;
    const auto task = task_;
    task_ = Task::none;
    const auto control = [&](Task next, std::uint8_t value) {
        set_sdo_timeout(setup.program.limit / 4);
        write(next, 0x1f51, number_of, value, 1);
    };
    switch (task) {
    case Task::control_read:
        if (object_missing()) return fail_transfer(BootResult::no_program);
        if (no_response()) return fail_transfer(BootResult::update);
        if (ok() && number() == stop_program) return control(Task::erase, clear_program);
        return control(Task::stop, stop_program);
    case Task::stop:
        if (!ok() && !no_response()) {
            return fail_transfer(object_missing() ? BootResult::no_program : BootResult::update);
        }
        return await_flash(Task::stop);
    case Task::erase:
        if (!ok() && !no_response()) return fail_transfer(BootResult::update);
        return await_flash(Task::erase);
    case Task::download:
        if (!ok()) {
            return fail_transfer(object_missing() ? BootResult::no_program : BootResult::update);
        }
        return await_flash(Task::download);
    case Task::launch:
        if (!ok() && !no_response()) return fail_transfer(BootResult::update);
        set_sdo_timeout(0);
        updated_ = true;
        status.notes |= note_updated;
        after_ = Task::launch;
        answer_deadline_ = now() + setup.program.limit;
        deadline_ = now() + 1 * second;  // or at its boot-up message, whichever is first
        return;
    case Task::flash: {
        if (!ok() && !no_response()) {  // without 1F57h its answers are all there is
            deadline_ = now();
            request_.abort = Abort::none;
            request_.size = 0;
            buffer_[0] = 0;
        }
        if (no_response() || (number() & flash_busy) != 0) {
            deadline_ = now() + flash_poll_interval;
            if (now() < answer_deadline_) return;
            note_request(0, no_response() ? 0 : number());
            return fail(BootResult::update, no_response() ? Cause::no_response : Cause::flash_busy);
        }
        const auto error = number() & flash_error;
        const bool matters = after_ == Task::download
                                 ? error != 0
                                 : after_ == Task::erase && error != 0 && error != no_valid_program;
        if (matters) {
            note_request(0, number());
            return fail(BootResult::update, Cause::flash);
        }
        if (after_ == Task::stop) return control(Task::erase, clear_program);
        if (after_ == Task::erase) {
            return write(Task::download, 0x1f50, number_of, setup.program.image);
        }
        return control(Task::launch, start_program);
    }
    default: return;
    }
}

/// Time for the next look.
void Master::Node::flash_ready() noexcept {
    if (after_ == Task::launch) return identify();
    read(Task::flash, 0x1f57, setup.program.number);
}

}  // namespace hal::canopen
