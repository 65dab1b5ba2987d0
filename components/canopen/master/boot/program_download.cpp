// SPDX-License-Identifier: MIT
#include "program_download.hpp"

#include <algorithm>
#include <string_view>

namespace hal::canopen {

namespace {

// Values of 1F51h, program control.
constexpr std::uint8_t stop_program = 0;
constexpr std::uint8_t start_program = 1;
constexpr std::uint8_t clear_program = 3;
// Bits of 1F57h, flash status.
constexpr std::uint64_t flash_busy = 1;
constexpr std::uint64_t flash_error = 0xfe;
constexpr std::uint64_t no_valid_program = 1 << 1;
constexpr Time flash_poll_interval = 100 * millisecond;

enum class Comparison : std::uint8_t { failed, equal, different };

/// What a request to the program objects waits for, as a step of CiA 302-3, figure 3.
enum class FlashStep : std::uint8_t { stop, clear, download };

/// Returns the letter for a rejected request: the node may have no program objects at all.
BootResult letter_of(const SdoAnswer& answer) noexcept {
    return answer.object_missing() ? BootResult::no_program : BootResult::update;
}

/// Returns true if the error bits of 1F57h mean that `step` failed.
bool is_flash_error(FlashStep step, std::uint64_t flash_status) noexcept {
    const std::uint64_t error = flash_status & flash_error;
    switch (step) {
    case FlashStep::stop: return false;
    case FlashStep::clear: return error != 0 && error != no_valid_program;
    case FlashStep::download: return error != 0;
    }
    return false;
}

/// Notes two versions for the message, the first eight characters of each.
void note_versions(NodeStatus& status, std::string_view expected, std::string_view found) noexcept {
    std::memcpy(&status.found, found.data(), std::min<std::size_t>(found.size(), 8));
    std::memcpy(&status.expected, expected.data(), std::min<std::size_t>(expected.size(), 8));
}

/// Reads the program identification, 1F56h, and the software version, 100Ah, as far as they are
/// configured.
Task<Comparison> compare_program(BootChannel& node) noexcept {
    const NodeProgram& program = node.setup.program;
    if (program.id != 0) {
        const SdoAnswer id = co_await node.read(0x1f56, program.number);
        if (!id.ok()) {
            node.fail_transfer(BootResult::no_program);
            co_return Comparison::failed;
        }
        if (id.number() != program.id) {
            node.note_answer(program.id, id.number());
            co_return Comparison::different;
        }
    }
    if (program.version.empty()) co_return Comparison::equal;
    const SdoAnswer version = co_await node.read(0x100a, 0);
    if (!version.ok()) {
        node.fail_transfer(BootResult::no_program);
        co_return Comparison::failed;
    }
    std::string_view found(reinterpret_cast<const char*>(version.value.data()),
                           version.value.size());
    found = found.substr(0, found.find('\0'));
    if (found == program.version) co_return Comparison::equal;
    node.note_answer(0, 0);
    note_versions(node.status, program.version, found);
    co_return Comparison::different;
}

/// CiA 302-3, figure 3: polls the flash status 1F57h until `step` is finished. No response means
/// that the node is busy or restarts. A node without 1F57h is ready when it has answered.
Task<bool> await_flash(BootChannel& node, FlashStep step) noexcept {
    const Time give_up = node.now() + node.setup.program.limit;
    Time next = node.now();
    for (;;) {
        co_await node.sleep_until(next);
        const SdoAnswer answer = co_await node.read(0x1f57, node.setup.program.number);
        const std::uint64_t flash_status = answer.ok() ? answer.number() : 0;
        if (!answer.no_response() && (flash_status & flash_busy) == 0) {
            if (!is_flash_error(step, flash_status)) co_return true;
            node.note_answer(0, flash_status);
            co_return node.fail(BootResult::update, Cause::flash);
        }
        next = node.now() + flash_poll_interval;
        if (node.now() < give_up) continue;
        node.note_answer(0, flash_status);
        co_return node.fail(BootResult::update,
                            answer.no_response() ? Cause::no_response : Cause::flash_busy);
    }
}

/// CiA 302-3, figure 3: writes 1F51h and waits until it is done. A node that stops its program may
/// restart without a response.
Task<bool> control_program(BootChannel& node, FlashStep step, std::uint8_t command) noexcept {
    const NodeProgram& program = node.setup.program;
    const SdoAnswer answer =
        co_await node.write(0x1f51, program.number, command, 1, program.limit / 4);
    const bool rejected = !answer.ok() && !answer.no_response();
    if (rejected) {
        co_return node.fail_transfer(step == FlashStep::stop ? letter_of(answer)
                                                             : BootResult::update);
    }
    const bool done = co_await await_flash(node, step);
    co_return done;
}

/// CiA 302-3, figure 3: stops the program, clears it, downloads the image and starts it.
Task<bool> replace_program(BootChannel& node) noexcept {
    const NodeProgram& program = node.setup.program;
    node.enter(Step::updating);

    const SdoAnswer control = co_await node.read(0x1f51, program.number);
    if (control.object_missing()) co_return node.fail_transfer(BootResult::no_program);
    if (control.no_response()) co_return node.fail_transfer(BootResult::update);
    const bool is_stopped = control.ok() && control.number() == stop_program;
    if (!is_stopped) {
        const bool stopped = co_await control_program(node, FlashStep::stop, stop_program);
        if (!stopped) co_return false;
    }

    const bool cleared = co_await control_program(node, FlashStep::clear, clear_program);
    if (!cleared) co_return false;

    const SdoAnswer download = co_await node.write(0x1f50, program.number, program.image);
    if (!download.ok()) co_return node.fail_transfer(letter_of(download));
    const bool flashed = co_await await_flash(node, FlashStep::download);
    if (!flashed) co_return false;

    const SdoAnswer launch =
        co_await node.write(0x1f51, program.number, start_program, 1, program.limit / 4);
    const bool rejected = !launch.ok() && !launch.no_response();
    if (rejected) co_return node.fail_transfer(BootResult::update);
    node.status.notes |= note_updated;
    co_return true;
}

}  // namespace

Task<ProgramCheck> check_program(BootChannel& node, bool downloaded) noexcept {
    const NodeProgram& program = node.setup.program;
    if (!program.checked()) co_return ProgramCheck::good;
    node.enter(Step::checking_program);
    const Comparison comparison = co_await compare_program(node);
    if (comparison == Comparison::failed) co_return ProgramCheck::failed;
    if (comparison == Comparison::equal) co_return ProgramCheck::good;

    if (downloaded) {
        node.fail(BootResult::update, Cause::not_retained);
        co_return ProgramCheck::failed;
    }
    if (!program.update) {
        node.fail(BootResult::no_update, Cause::mismatch);
        co_return ProgramCheck::failed;
    }
    if (program.image.empty()) {
        node.fail(BootResult::no_program, Cause::no_image);
        co_return ProgramCheck::failed;
    }
    const bool replaced = co_await replace_program(node);
    co_return replaced ? ProgramCheck::replaced : ProgramCheck::failed;
}

}  // namespace hal::canopen
