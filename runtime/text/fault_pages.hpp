// SPDX-License-Identifier: MIT
// Codes of faults of a running machine that no command reports, and their pages for `hal explain`,
// as in code_pages.hpp: sorted by name, which never changes. tests/errors/<name>.sh provokes them.
#pragma once

#include <algorithm>
#include <iterator>
#include <string_view>
#include <vector>

#include "text/code_pages.hpp"

namespace hal {

inline constexpr CodePage fault_pages[] = {
    {"budget",
     "A fault: a cycle took longer than the budget of its thread (`newthread ... budget=TIME`). It "
     "is recorded when the cycle ends and names "
     "the function in which the cycle was last seen; the thread continues. `show timing` counts "
     "such cycles as over budget.\n\n"
     "`show timing THREAD` and the parameters FUNCTION.tmax show which functions take long. A "
     "budget is a warning before a deadline is "
     "missed; a cycle of 10 periods or more is an `overrun`, whatever the budget."},
    {"component",
     "A fault that a component raised: a lost node, a sensor out of range, a rejected value. The "
     "message names the instance, the cause and "
     "the reaction; the thread continues. `hal doc COMPONENT` describes how to reset the fault.\n\n"
     "`show fault` lists all faults, `fault clear` acknowledges those that are over. The component "
     "`faults` has pins for the safety chain (`ok`, `last-code`)."},
    {"cycle-violation",
     "A fault: a function changed something outside of its instance. The message names the function "
     "and what it did:\n\n"
     "* It changed the floating-point modes of its thread (rounding, flush to zero, exceptions that "
     "trap) and did not restore them. They are reset behind the function; the thread continues. A "
     "function that did so in one cycle only may remain unknown.\n"
     "* It called `fork()`. The copy of the process is ended at once; the thread continues. Start "
     "programs with `loadusr`, or by fork and exec in `start` or in a thread of the component's "
     "own.\n"
     "* It ended its thread (`pthread_exit`). No function of the thread runs any more, and its "
     "outputs were set to their safe values; `start` lets them run again. In a constructor or in "
     "`start`, outputs are set to their safe values, and the process ends with status 1.\n"
     "* It put another program in the place of the process (`execve` and its relatives). Outputs are "
     "set to their safe values, and the process ends with status 1 instead.\n"
     "* It closed or replaced a file descriptor of the runtime, such as the control socket. Outputs "
     "are set to their safe values, and the process ends with status 1.\n\n"
     "The usual cause of a closed descriptor is one that is closed twice: another open file has got "
     "its number meanwhile."},
    {"exception",
     "A fault: a function threw an exception in its cycle. No function of its thread runs any "
     "more, and the outputs of the thread were "
     "set to their safe values; other threads continue. `start` lets the thread's functions run "
     "again. The exit status is then 1.\n\n"
     "Functions of a cycle are `noexcept` and must not throw: they set an output or raise a fault "
     "of their own instead. "
     "`hal compile --check-rt` finds such components before they are loaded."},
    {"not-finite",
     "A fault: an output that its component declares finite became NaN or infinite, for example "
     "after a division by zero. The output was "
     "set to its declared safe value instead (0 if it declares none), and the thread continues. "
     "The fault is recorded once until the value "
     "is finite again.\n\n"
     "`show pin INSTANCE` shows the component's inputs: one of them is usually 0, NaN or far out "
     "of its range."},
    {"overrun",
     "A fault: a cycle took at least 10 periods of its thread. It is recorded when the cycle ends "
     "and names the function in which the cycle "
     "was last seen. The periods that passed meanwhile are missed; the thread keeps its phase and "
     "continues. A cycle that does not end "
     "within the supervision limit of the thread is `hung-thread` instead.\n\n"
     "Possible causes: a function that blocks, waits or computes for long; a thread without "
     "real-time scheduling on a busy host (`hal "
     "doctor`); a period that is too short. `show timing` and the parameters FUNCTION.tmax show "
     "which function it was."},
};

/// Code of a fault; naming one without a page does not compile.
class FaultCode {
public:
    consteval FaultCode(const char* name) : name_(name) {
        const auto is_it = [name](const CodePage& page) {
            return std::string_view(page.name) == name;
        };
        if (std::none_of(std::begin(fault_pages), std::end(fault_pages), is_it) &&
            std::none_of(std::begin(code_pages), std::end(code_pages), is_it)) {
            throw "this code is neither in fault_pages.hpp nor in code_pages.hpp";
        }
    }
    constexpr const char* name() const { return name_; }

private:
    const char* name_;
};

/// All pages, by name.
inline std::vector<CodePage> all_code_pages() {
    std::vector<CodePage> all(std::begin(code_pages), std::end(code_pages));
    all.insert(all.end(), std::begin(fault_pages), std::end(fault_pages));
    std::sort(all.begin(), all.end(), [](const CodePage& a, const CodePage& b) {
        return std::string_view(a.name) < b.name;
    });
    return all;
}

}  // namespace hal
