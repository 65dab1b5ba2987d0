// SPDX-License-Identifier: MIT
#include "run/difference_inputs.hpp"

#include <algorithm>
#include <cstdint>
#include <fmt/core.h>
#include <map>
#include <vector>

#include "run/replayed_machine.hpp"
#include "text/numbers.hpp"

namespace hal::tools {
namespace {

constexpr std::size_t max_lines = 40;

using PinWords = std::map<const Pin*, std::uint64_t>;

std::vector<const Pin*> inputs_of(const LoadedFunction& function, const Instance& instance) {
    std::vector<const Pin*> pins;
    for (const auto& pin : instance.pins) {
        const bool is_input = pin->dir == HAL_DIR_IN || pin->dir == HAL_DIR_IO;
        if (is_input && (!pin->function || pin->function == &function)) {
            pins.push_back(pin.get());
        }
    }
    return pins;
}

/// Returns true when the value was written in the same cycle of the same thread, but afterwards.
bool is_written_later(const Pin& pin, const LoadedFunction& reader) {
    const Pin* const writer = pin.signal ? pin.signal->writer : nullptr;
    if (!writer || !writer->home || writer->home != pin.home) return false;
    const auto& order = pin.home->functions;
    const auto at = [&order](const auto& suits) { return std::ranges::find_if(order, suits); };
    const auto own = at([&reader](const LoadedFunction* one) { return one == &reader; });
    const auto theirs = at([writer](const LoadedFunction* one) {
        if (writer->function) return one == writer->function;
        return std::ranges::find(one->instances, writer->instance) != one->instances.end();
    });
    return theirs >= own;
}

PinWords read(const std::vector<const Pin*>& pins) {
    PinWords words;
    for (const Pin* const pin : pins) {
        words[pin] = pin->memory->slot->raw;  // no cycle runs
    }
    return words;
}

std::string text_of(const LoadedFunction& function, const std::vector<const Pin*>& pins,
                    const PinWords& before, const PinWords& after) {
    std::string text = fmt::format("inputs of '{}' in this cycle:\n", function.name);
    std::size_t lines = 0;
    for (const Pin* const pin : pins) {
        if (++lines > max_lines) {
            text += "  ...\n";
            break;
        }
        const PinWords& words = is_written_later(*pin, function) ? before : after;
        const auto word = words.find(pin);
        const std::string value = word == words.end()
                                      ? "unknown"
                                      : format_exact(pin->type, hal_value{.raw = word->second});
        text += fmt::format("  {} {}\n", pin->name, value);
    }
    return lines == 0 ? "" : text;
}

/// Executes one cycle. Returns false when the journal has no further one. What no journal reproduces
/// may differ in another cycle than before: that does not end the execution.
bool execute_cycle(ReplayedMachine& machine) {
    const std::uint64_t executed = machine.execution().cycles();
    const bool goes_on = machine.advance();
    if (!goes_on && machine.execution().state() == ReExecution::State::differs) {
        machine.execution().pass_difference();
    }
    return machine.execution().cycles() != executed;
}

bool is_behind(const JournaledCycle& newest, const ValueDifference& difference) {
    return newest.thread == difference.thread && newest.number > difference.cycle;
}

}  // namespace

std::string inputs_of(const ReplayOptions& options, const ValueDifference& difference) {
    JournalFile file;
    if (!file.open(options.words[0])) return "";
    ReplayedMachine machine(options, file, ReplayedMachine::Compare::checksums);
    const auto lock = machine.session().lock();
    const JournaledCycle& newest = machine.execution().newest();
    constexpr std::uint64_t near = 1000;  // cycles: the one before, whatever was missed
    PinWords before;
    std::string text;
    while (text.empty() && execute_cycle(machine) && !is_behind(newest, difference)) {
        if (newest.thread != difference.thread || newest.number + near < difference.cycle) continue;
        const LoadedFunction* const function = machine.function_of(difference.name);
        if (!function) continue;
        const std::vector<const Pin*> pins =
            inputs_of(*function, *machine.writer(difference.name)->instance);
        const PinWords after = read(pins);
        if (newest.number == difference.cycle) {
            text = text_of(*function, pins, before, after);
        }
        before = after;
    }
    machine.execution().finish();
    return text;
}

}  // namespace hal::tools
