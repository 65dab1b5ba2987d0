// SPDX-License-Identifier: MIT
// The program of a node (CiA 302-3): is it the right one, and if not: stop it, erase it, download, wait for the flash, start it.
#include <algorithm>

#include "boot_node.hpp"

namespace hal::canopen {

namespace {
constexpr std::uint8_t stop_program = 0, start_program = 1, clear_program = 3;
constexpr Time between_looks = 100 * millisecond;  // at 1F57h
constexpr std::uint64_t flash_busy = 1, flash_error = 0xfe, no_valid_program = 1 << 1;
}  // namespace

void Master::Node::check_program() noexcept {
    if (!setup.program.checked()) return configure();
    enter(Step::checking_program);
    if (setup.program.id != 0) return read(Task::program_id, 0x1f56, setup.program.number);
    read(Task::program_version, 0x100a, 0);
}

void Master::Node::program_right() noexcept { configure(); }

void Master::Node::program_differs() noexcept {
    if (updated_) return fail(BootResult::update, Cause::not_taken);
    if (!setup.program.update) return fail(BootResult::no_update, Cause::differs);
    if (setup.program.image.empty()) return fail(BootResult::no_program, Cause::no_image);
    update();
}

void Master::Node::update() noexcept {
    after_ = Task::none;
    enter(Step::updating);
    read(Task::control_read, 0x1f51, setup.program.number);
}

/// Looks at the flash until it is ready for what follows `after`. Its silence means that it works, or restarts.
void Master::Node::await_flash(Task after) noexcept {
    after_ = after;
    patience(0);
    patience_ = now() + setup.program.limit;
    deadline_ = now();
}

void Master::Node::update_answered() noexcept {
    const auto number_of = setup.program.number;
    const auto task = task_;
    task_ = Task::none;
    const auto control = [&](Task next, std::uint8_t value) {
        patience(setup.program.limit / 4);
        write(next, 0x1f51, number_of, value, 1);
    };
    switch (task) {
    case Task::control_read:
        if (lacks()) return fail_transfer(BootResult::no_program);
        if (silent()) return fail_transfer(BootResult::update);
        if (ok() && number() == stop_program) return control(Task::erase, clear_program);
        return control(Task::stop, stop_program);
    case Task::stop:
        if (!ok() && !silent()) return fail_transfer(lacks() ? BootResult::no_program : BootResult::update);
        return await_flash(Task::stop);
    case Task::erase:
        if (!ok() && !silent()) return fail_transfer(BootResult::update);
        return await_flash(Task::erase);
    case Task::download:
        if (!ok()) return fail_transfer(lacks() ? BootResult::no_program : BootResult::update);
        return await_flash(Task::download);
    case Task::launch:
        if (!ok() && !silent()) return fail_transfer(BootResult::update);
        patience(0);
        updated_ = true;
        status.notes |= note_updated;
        after_ = Task::launch;
        patience_ = now() + setup.program.limit;
        deadline_ = now() + 1 * second;  // or its boot-up message, whichever is first
        return;
    case Task::flash: {
        if (!ok() && !silent()) {  // without 1F57h its answers are all there is
            deadline_ = now();
            request_.abort = Abort::none, request_.size = 0;
            room_[0] = 0;
        }
        if (silent() || (number() & flash_busy) != 0) {
            deadline_ = now() + between_looks;
            if (now() < patience_) return;
            about_request(0, silent() ? 0 : number());
            return fail(BootResult::update, silent() ? Cause::silent : Cause::flash_busy);
        }
        const auto error = number() & flash_error;
        const bool matters = after_ == Task::download ? error != 0 : after_ == Task::erase && error != 0 && error != no_valid_program;
        if (matters) {
            about_request(0, number());
            return fail(BootResult::update, Cause::flash);
        }
        if (after_ == Task::stop) return control(Task::erase, clear_program);
        if (after_ == Task::erase) return write(Task::download, 0x1f50, number_of, setup.program.image);
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
