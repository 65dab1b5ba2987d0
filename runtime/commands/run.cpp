// SPDX-License-Identifier: MIT
// start, stop, advance, lock, unlock: commands that act on the machine as a whole.
#include <algorithm>
#include <chrono>
#include <thread>

#include "commands/table.hpp"
#include "text/numbers.hpp"

namespace hal {
namespace {

constexpr auto look_again = std::chrono::milliseconds(1);

std::optional<std::uint64_t> whole_number(std::string_view text) {
    std::uint64_t number = 0;
    return parse_whole(text, number) ? std::optional(number) : std::nullopt;
}

/// Waits, without holding the lock of the session, until `done` (called with it) returns true.
template <class Done>
void wait_for(Context& context, Done&& done) {
    while (!done() && !context.interrupted()) {
        context.lock.unlock();
        std::this_thread::sleep_for(look_again);
        context.lock.lock();
    }
}

/// On the virtual clock in steps, so that other clients can access the machine and a long
/// simulation can be ended.
void advance_ns(Context& context, std::int64_t ns) {
    if (context.checking()) return;
    Session& session = context.session;
    if (session.options().virtual_clock) {
        constexpr std::int64_t piece = 100'000'000;
        for (; ns > 0 && !context.interrupted(); ns -= piece) {
            session.threads().advance_ns(std::min(ns, piece));
            context.lock.unlock();
            context.lock.lock();
        }
        return;
    }
    const std::int64_t end = session.threads().now_ns() + ns;
    wait_for(context, [&] { return session.threads().now_ns() >= end; });
}

void advance_cycles(Context& context, std::uint64_t cycles) {
    Session& session = context.session;
    // what is missing could have made a thread
    const bool unknown = context.checking() && session.absences().open();
    if (session.model().threads.empty() && !unknown) {
        context.diagnostics.error("no-thread", context.span(0), "cannot advance: no thread exists",
                                  "", "create one with `newthread servo-thread 1000000`");
        return;
    }
    if (context.checking()) return;
    if (session.options().virtual_clock) {
        constexpr std::uint64_t piece = 1000;
        for (; cycles > 0 && !context.interrupted(); cycles -= std::min(cycles, piece)) {
            session.threads().advance_cycles(std::min(cycles, piece));
            context.lock.unlock();
            context.lock.lock();
        }
        return;
    }
    const std::string fastest = session.model().threads.front()->name;
    const std::uint64_t end =
        session.reports().thread(*session.model().threads.front()).cycles + cycles;
    wait_for(context, [&] {
        const Thread* const thread = session.model().find_thread(fastest);
        if (!thread) return true;
        const ThreadReport report = session.reports().thread(*thread);
        return report.cycles >= end ||
               (report.hung && session.threads().report_hung(context.diagnostics));
    });
}

}  // namespace

void command_start(Context& context) {
    Session& session = context.session;
    if (!context.transaction) {
        session.threads().start(&context.diagnostics);
        return;
    }
    context.transaction->needs_threads();
    context.transaction->when_committed([&session] { session.threads().start(); });
}

void command_stop(Context& context) {
    Session& session = context.session;
    if (!context.transaction) {
        session.threads().stop(&context.diagnostics);
        return;
    }
    context.transaction->needs_threads();
    context.transaction->when_committed([&session] { session.threads().stop(); });
}

namespace {

/// Reports an `advance` that would advance one of several machines alone. Returns true for one.
bool reject_shared_time(Context& context) {
    const ShellOptions& options = context.options();
    if (!options.shared_time) return false;
    const std::string amount = context.argument(0);
    context.diagnostics.error(
        "shared-time", context.command.span,
        "'advance' in a netlist for several machines, whose time passes for all together", "",
        "leave it out and use --for " + amount + ", or -e 'all: advance " + amount + "'; --node " +
            options.node + " simulates this node only");
    return true;
}

/// Returns whether the amount of an `advance` has a unit, and only its number does not fit.
bool is_too_large(const Context& context) {
    const auto quantity = parse_quantity(context.argument(0));
    if (!quantity || quantity->number < 1) return false;
    if (context.count() == 2) {
        const bool is_whole =
            context.argument(0).find_first_not_of("0123456789") == std::string::npos;
        return is_whole && context.argument(1).starts_with("cycle");
    }
    return !quantity->unit.empty() && parse_duration_ns("0" + std::string(quantity->unit));
}

}  // namespace

void command_advance(Context& context) {
    if (reject_shared_time(context)) return;
    const std::string& amount = context.argument(0);
    if (context.count() == 2) {
        const auto cycles = whole_number(amount);
        if (cycles && context.argument(1).starts_with("cycle")) {
            return advance_cycles(context, *cycles);
        }
    } else if (!whole_number(amount)) {
        if (const auto ns = parse_duration_ns(amount)) return advance_ns(context, *ns);
    }
    const char* const problem = is_too_large(context) ? "' is too large" : "' has no valid unit";
    context.diagnostics.error(
        "bad-duration", context.span(0), "'" + amount + problem, "",
        "write `advance 10 cycles`, or a time with its unit: `advance 250ms`");
}

void command_lock(Context& context) {
    const std::string_view level = context.argument_or(0, "all");
    if (level == "none") {
        *context.locks = static_cast<unsigned>(Lock::none);
    } else if (level == "tune") {
        *context.locks = static_cast<unsigned>(Lock::tune);
    } else if (level == "all") {
        *context.locks = static_cast<unsigned>(Lock::all);
    } else {
        context.diagnostics.error("unknown-word", context.span(0),
                                  "unknown lock '" + std::string(level) + "'", "",
                                  "the locks are: none, tune, all");
    }
}

void command_unlock(Context& context) {
    const std::string_view level = context.argument_or(0, "all");
    if (level == "all" || level == "none") {
        *context.locks = static_cast<unsigned>(Lock::none);
    } else if (level == "tune") {
        *context.locks &= ~static_cast<unsigned>(Lock::tune);
    } else {
        context.diagnostics.error("unknown-word", context.span(0),
                                  "unknown lock '" + std::string(level) + "'", "",
                                  "the choices are: all, none, tune");
    }
}

}  // namespace hal
