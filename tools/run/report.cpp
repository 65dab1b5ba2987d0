// SPDX-License-Identifier: MIT
#include "run/report.hpp"

#include <algorithm>
#include <fmt/core.h>

#include "base/types.hpp"
#include "text/quoting.hpp"

namespace hal::tools {

namespace {

/// "a b c" in lines of at most 100 columns, continued under the first word; beyond `max` words: "…
/// 31 more".
std::string wrapped(const std::string& head, const std::vector<std::string>& words,
                    std::size_t max) {
    constexpr std::size_t columns = 100;
    std::string text, line = head;
    bool first = true;
    for (std::size_t i = 0; i < words.size(); ++i) {
        const std::string word = i < max ? words[i] : fmt::format("… {} more", words.size() - max);
        if (!first && line.size() + 1 + word.size() > columns) {
            text += line + "\n";
            line = std::string(head.size(), ' ');
            first = true;
        }
        line += (first ? "" : " ") + word;
        first = false;
        if (i >= max) break;
    }
    return text + line + "\n";
}

struct Slowest {
    const LoadedFunction* function;
    double mean_ns, max_ns;
};

std::vector<Slowest> slowest_functions(const Model& model, std::size_t max) {
    std::vector<Slowest> all;
    for (const auto& thread : model.threads) {
        for (const LoadedFunction* function : thread->functions) {
            const plan::FunctionTimes& times = *function->times;
            const std::uint64_t samples = times.samples.load(std::memory_order_relaxed);
            if (samples == 0) continue;
            all.push_back(
                {function,
                 static_cast<double>(times.total_ns.load(std::memory_order_relaxed)) /
                     static_cast<double>(samples),
                 static_cast<double>(__atomic_load_n(&times.tmax.slot->s32, __ATOMIC_RELAXED))});
        }
    }
    std::stable_sort(all.begin(), all.end(),
                     [](const Slowest& a, const Slowest& b) { return a.max_ns > b.max_ns; });
    if (all.size() > max) {
        all.resize(max);
    }
    return all;
}

/// The last faults, a line for each.
std::string sentences(const std::vector<FaultRecord>& faults) {
    constexpr std::size_t max = 10;
    std::string text;
    for (std::size_t i = faults.size() > max ? faults.size() - max : 0; i < faults.size(); ++i) {
        text += "  " + faults[i].line() + "\n";
    }
    return text;
}

/// One line when so many periods were missed that the results may not be those of an undisturbed
/// run.
std::string busy_line(const std::vector<ThreadReport>& reports) {
    // that was the cause
    if (std::any_of(reports.begin(), reports.end(),
                    [](const ThreadReport& r) { return r.hangs != 0; })) {
        return {};
    }
    const ThreadReport* worst = nullptr;
    double worst_share = 0.001;
    for (const ThreadReport& r : reports) {
        const double share = static_cast<double>(r.missed) /
                             static_cast<double>(std::max<std::uint64_t>(r.cycles + r.missed, 1));
        if (r.missed < 5 || share < worst_share) continue;
        worst = &r;
        worst_share = share;
    }
    if (!worst) {
        return {};
    }
    return fmt::format(
        "the machine was too busy: thread {} missed {} of {} periods ({:.1f} %), so controlled "
        "axes may have behaved "
        "differently than on an idle one; see: hal doctor\n",
        worst->name, worst->missed, worst->cycles + worst->missed, 100 * worst_share);
}

}  // namespace

std::string loaded_summary(Session& session) {
    const auto lock = session.lock();
    const Model& model = session.model();
    std::size_t instances = 0;
    std::size_t width = 0;
    std::vector<const LoadedComponent*> shown;
    for (const auto& component : model.components) {
        if (!component->instances.empty()) {
            instances += component->instances.size();
            shown.push_back(component.get());
            width = std::max(width, component->name.size());
        }
    }
    for (const auto& thread : model.threads) {
        width = std::max(width, thread->name.size());
    }
    std::string text = fmt::format(
        "{} of {}, {}, {}\n", counted(instances, "instance"), counted(shown.size(), "component"),
        counted(model.signals.size(), "signal"), counted(model.threads.size(), "thread"));
    for (const LoadedComponent* component : shown) {
        std::vector<std::string> names;
        for (const auto& instance : component->instances) {
            names.push_back(instance->name);
        }
        text += wrapped(fmt::format("  {:{}}  ", component->name, width), names, 24);
    }
    for (const auto& thread : model.threads) {
        std::vector<std::string> names;
        for (const LoadedFunction* function : thread->functions) {
            names.push_back(function->name);
        }
        if (names.empty()) {
            names.emplace_back("(no functions)");
        }
        text +=
            wrapped(fmt::format("  {:{}}  every {}: ", thread->name, width,
                                format_duration(static_cast<double>(thread->options.period_ns))),
                    names, 24);
    }
    for (const ThreadReport& report : session.reports().threads()) {
        if (!report.supervised) {
            text +=
                fmt::format("thread {} is not supervised (supervise=off): a hang is not detected\n",
                            report.name);
        }
    }
    for (const std::string& line : session.reports().missing_privileges()) {
        text += line + "\n";
    }
    return text;
}

std::string timing_report(Session& session) {
    const auto lock = session.lock();
    const std::vector<ThreadReport> reports = session.reports().threads();
    std::string text;
    if (reports.empty()) return text;
    std::size_t width = 6;
    for (const ThreadReport& report : reports) {
        width = std::max(width, report.name.size());
    }
    constexpr const char* columns =
        "{:{}}  {:>9} {:>10} {:>7}  {:>11} {:>9} {:>9}  {:>9} {:>9} {:>9}\n";
    text += fmt::format(columns, "thread", width, "period", "cycles", "missed", "wake-up p50",
                        "p99", "max", "busy p50", "p99", "max");
    for (const ThreadReport& r : reports) {
        text +=
            fmt::format(columns, r.name, width, format_duration(static_cast<double>(r.period_ns)),
                        r.cycles, r.missed, r.figure(r.wakeup_p50_ns), r.figure(r.wakeup_p99_ns),
                        r.figure(r.wakeup_max_ns), r.figure(r.busy_p50_ns), r.figure(r.busy_p99_ns),
                        r.figure(r.busy_max_ns));
    }
    std::string policies;
    for (const ThreadReport& r : reports) {
        append_item(policies, fmt::format("{}: {}", r.name, r.policy), "; ");
        if (r.cpu >= 0) {
            policies += fmt::format(" on cpu {}", r.cpu);
        }
        if (r.page_faults != 0) {
            policies += fmt::format(", {} page faults", r.page_faults);
        }
        if (r.over_budget != 0) {
            policies += fmt::format(", {} cycles over budget", r.over_budget);
        }
        if (r.hung) {
            policies +=
                fmt::format(", hangs{} for {}", r.function.empty() ? "" : " in " + r.function,
                            format_duration(static_cast<double>(r.silent_ns)));
        } else if (r.faulted) {
            policies += ", stopped by a fault";
        }
    }
    text += policies + "\n";
    std::vector<std::string> functions;
    for (const Slowest& s : slowest_functions(session.model(), 5)) {
        functions.push_back(fmt::format("{} {} (max {})", s.function->name,
                                        format_duration(s.mean_ns), format_duration(s.max_ns)));
    }
    if (!functions.empty()) {
        text += "slowest functions:";
        for (std::size_t i = 0; i < functions.size(); ++i) {
            text += (i == 0 ? " " : ", ") + functions[i];
        }
        text += "\n";
    }
    const std::vector<FaultRecord> faults = session.reports().faults();
    if (!faults.empty()) {
        text += fmt::format("{}:\n", counted(session.reports().fault_count(), "fault"));
    }
    return text + sentences(faults) + busy_line(reports);
}

std::string simulated_summary(Session& session, std::string_view before) {
    const auto lock = session.lock();
    std::string text(before);
    for (const ThreadReport& report : session.reports().threads()) {
        text += fmt::format("; {} {}{}", report.name, counted(report.cycles, "cycle"),
                            report.faulted ? ", stopped by a fault" : "");
    }
    const std::vector<FaultRecord> faults = session.reports().faults();
    if (faults.empty()) return text + "; no faults\n";
    return text + fmt::format("; {}:\n", counted(session.reports().fault_count(), "fault")) +
           sentences(faults);
}

}  // namespace hal::tools
