// SPDX-License-Identifier: MIT
#include "runtime.hpp"

#include <fmt/core.h>
#include <stdexcept>

#include "commands/table.hpp"
#include "machine.hpp"
#include "sample.hpp"

namespace hal::bench {

namespace {
SessionOptions options(bool virtual_clock) {
    SessionOptions options;
    options.name = "bench";
    options.virtual_clock = virtual_clock;
    return options;
}
}  // namespace

Runtime::Runtime(bool virtual_clock) : session(options(virtual_clock)) {}

Applied Runtime::apply(std::string text) {
    Applied cost;
    Diagnostics diagnostics;
    const auto source = session.sources.add("bench.hal", std::move(text));
    const CpuStopwatch cpu;
    const Stopwatch parsing;
    const auto commands =
        parse(session.sources, source, Environment{&session.ini, {}}, diagnostics);
    cost.parse = parsing.ms();
    const Stopwatch applying;
    Transaction transaction = session.begin();
    for (const Command& command : commands) {
        apply_edit(transaction, command, diagnostics);
    }
    cost.apply = applying.ms();
    const Stopwatch committing;
    const bool good = transaction.commit(diagnostics);
    cost.commit = committing.ms();
    cost.cpu = cpu.ms();
    if (!good) {
        throw std::runtime_error(diagnostics.all().empty()
                                     ? "an edit was rejected"
                                     : render(diagnostics.all().front(), session.sources));
    }
    return cost;
}

std::string new_thread(std::string_view name, long period_ns, int cpu, std::string_view more) {
    return fmt::format("newthread {} {} cpu={} priority={} {}\n", name, period_ns, cpu, priority,
                       more);
}

}  // namespace hal::bench
