// SPDX-License-Identifier: MIT
// status, fault, and what `show` reports beyond LinuxCNC: timing, latency, faults.
#include <algorithm>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "commands/describe.hpp"
#include "commands/json_text.hpp"
#include "commands/listing.hpp"
#include "commands/script.hpp"
#include "commands/table.hpp"

namespace hal {
namespace {

void lock_status(std::string& text, unsigned lock) {
    static constexpr std::pair<unsigned, const char*> bits[] = {
        {1, "  HAL_LOCK_LOAD    - loading of new components is locked\n"},
        {2, "  HAL_LOCK_CONFIG  - link and addf is locked\n"},
        {4, "  HAL_LOCK_PARAMS  - setting params is locked\n"},
        {8, "  HAL_LOCK_RUN     - running/stopping HAL is locked\n"}};
    text += fmt::format("HAL locking status:\n  current lock value {} ({:02x})\n", lock, lock);
    if (lock == 0) {
        text += "  HAL_LOCK_NONE - nothing is locked\n";
    }
    for (const auto& [bit, line] : bits) {
        if (lock & bit) {
            text += line;
        }
    }
}

struct Counts {
    std::size_t components = 0;
    std::size_t instances = 0;
    std::size_t pins = 0;
    std::size_t parameters = 0;
    std::size_t aliases = 0;
    std::size_t signals = 0;

    std::size_t functions = 0;
    std::size_t threads = 0;
};

Counts count(const Model& model) {
    Counts counts{model.components.size(), model.instance.size(), 0, 0, 0, model.signals.size(),
                  model.function.size(),   model.threads.size()};
    for (const auto& [name, pin] : model.pin) {
        if (name != pin->name) {
            ++counts.aliases;
        } else {
            ++(is_parameter(*pin) ? counts.parameters : counts.pins);
        }
    }
    return counts;
}

/// In place of LinuxCNC's memory table: there is no fixed memory here that could run out, nor
/// anything recycled.
void memory_status(std::string& text, const Model& model) {
    const Counts counts = count(model);
    text += "HAL memory status\n";
    const auto add = [&](const char* what, std::size_t number) {
        text += fmt::format("  active {:<12} {}\n", std::string(what) + ":", number);
    };
    add("components", counts.components);
    add("instances", counts.instances);
    add("pins", counts.pins);
    add("parameters", counts.parameters);
    add("aliases", counts.aliases);
    add("signals", counts.signals);
    add("functions", counts.functions);
    add("threads", counts.threads);
}

/// Returns the number of faults that are not acknowledged when the open transaction takes effect.
std::uint64_t unacknowledged(const Context& context) {
    const Reports& reports = context.session.reports();
    return context.script.clears_faults() ? reports.lasting_count() : reports.fault_count();
}

std::string status_json(const Context& context) {
    const Session& session = context.session;
    const Counts c = count(session.model());
    return json_text({{"instance", session.options().name},
                      {"running", session.threads().running()},
                      {"lock", context.script.locks()},
                      {"faults", unacknowledged(context)},
                      {"components", c.components},
                      {"instances", c.instances},
                      {"pins", c.pins},
                      {"parameters", c.parameters},
                      {"aliases", c.aliases},
                      {"signals", c.signals},
                      {"functions", c.functions},
                      {"threads", c.threads}}) +
           "\n";
}

/// Three figures of a distribution in one column each.
std::string figures(const ThreadReport& thread, double p50, double p99, double max) {
    return fmt::format("{:>9} {:>9} {:>9}", thread.figure(p50), thread.figure(p99),
                       thread.figure(max));
}

/// The mean and the maximum of the sampled calls of a function; a maximum of 0 was reset.
std::string call_figures(const plan::FunctionTimes& times, std::int32_t max_ns) {
    const auto samples = times.samples.load(std::memory_order_relaxed);
    const auto total = times.total_ns.load(std::memory_order_relaxed);
    const double mean =
        samples == 0 ? 0 : static_cast<double>(total) / static_cast<double>(samples);
    return fmt::format("{:>9} {:>9} {:>9}", samples == 0 ? "-" : format_duration(mean),
                       max_ns == 0 ? "-" : format_duration(max_ns), samples);
}

/// What is not ordinary about a thread.
std::string state_of(const ThreadReport& r) {
    std::string text = r.supervised ? "" : ", not supervised";
    if (r.hung) {
        text +=
            fmt::format(", hangs{} for {}", r.function.empty() ? "" : " in '" + r.function + "'",
                        format_duration(static_cast<double>(r.silent_ns)));
    } else if (r.faulted) {
        text += ", stopped by a fault";
    }
    return text;
}

}  // namespace

void command_status(Context& context) {
    const std::string_view what = context.argument_or(0, "all");
    if (what != "all" && what != "lock" && what != "mem" && what != "instance") {
        context.diagnostics.error("unknown-word", context.span(0),
                                  "unknown status '" + std::string(what) + "'", "",
                                  "the choices are: lock, mem, instance, all");
        return;
    }
    if (context.checking()) return;
    if (what == "instance") return context.output.out(context.session.reports().status_text());
    if (context.options().json) return context.output.out(status_json(context));
    std::string text;
    if (what != "mem") {
        lock_status(text, context.script.locks());
    }
    if (what != "lock") {
        memory_status(text, context.session.model());
    }
    context.output.out(text);
}

namespace {

/// Returns the words behind the kind of a `show`.
std::vector<std::string> words_of(const Context& context) {
    std::vector<std::string> words;
    for (std::size_t i = 1; i < context.count(); ++i) {
        words.push_back(context.argument(i));
    }
    return words;
}

template <class Objects>
std::vector<std::string> names_of(const Objects& objects) {
    std::vector<std::string> names;
    for (const auto& [name, object] : objects) {
        names.emplace_back(name);
    }
    return names;
}

}  // namespace

void show_timing(Context& context) {
    const std::vector<std::string> words = words_of(context);
    const Model& model = context.session.model();
    for (std::size_t i = 0; i < words.size(); ++i) {
        if (!threads_slowest_first(model, Patterns({words[i]})).empty()) continue;
        const auto names = names_of(model.thread);
        context.diagnostics.error("no-such-thread", context.span(i + 1),
                                  "unknown thread '" + words[i] + "'",
                                  did_you_mean(words[i], names),
                                  names.empty() ? "no thread exists" : "threads: " + listed(names));
    }
    if (context.diagnostics.failed()) return;
    const Patterns patterns(words);
    std::string text;
    if (context.options().json) {
        describe(text, context.session, Listed::threads, patterns, std::nullopt);
        return context.output.out(text + "\n");
    }
    const auto threads = threads_slowest_first(context.session.model(), patterns);
    text +=
        "Threads:                                                 wake-up lateness              "
        "execution time\n"
        "Name                     Period     Cycles   Missed       p50       p99       max       "
        "p50       p99       max  Scheduling\n";
    for (const Thread* const thread : threads) {
        const ThreadReport r = context.session.reports().thread(*thread);
        text += fmt::format("{:<20} {:>10} {:>10} {:>8} {} {}  {}{}{}\n", r.name,
                            format_duration(static_cast<double>(r.period_ns)), r.cycles, r.missed,
                            figures(r, r.wakeup_p50_ns, r.wakeup_p99_ns, r.wakeup_max_ns),
                            figures(r, r.busy_p50_ns, r.busy_p99_ns, r.busy_max_ns), r.policy,
                            r.cpu >= 0 ? fmt::format(", CPU {}", r.cpu) : "", state_of(r));
    }
    text += clock_text(context.session);
    text += "\nFunctions:                                    Mean       Max   Samples  Thread\n";
    std::vector<const Pin*> maxima;
    std::vector<const LoadedFunction*> functions;
    for (const Thread* const thread : threads) {
        for (const LoadedFunction* const function : thread->functions) {
            const Pin* const tmax = context.session.model().find_pin(function->name + ".tmax");
            if (!tmax) continue;
            functions.push_back(function);
            maxima.push_back(tmax);
        }
    }
    const auto values = context.session.values().read_pins(maxima);
    for (std::size_t i = 0; i < functions.size(); ++i) {
        const LoadedFunction& function = *functions[i];
        text += fmt::format("{:<40} {}  {}\n", function.name,
                            call_figures(*function.times, values[i].s32), function.thread->name);
    }
    context.output.out(text + "\n");
}

namespace {

/// Returns true when a line of `show latency` is about what the pattern names: its signal, a pin,
/// or the line itself.
bool is_about(const std::string& line, const Patterns& pattern) {
    if (pattern.match(line)) return true;
    // "SIGNAL: WRITER => READER  0 cycles (...)"
    const std::size_t end = std::min(line.find("  "), line.size());
    for (std::size_t at = 0; at < end;) {
        const std::size_t stop = std::min(line.find(' ', at), end);
        std::string word = line.substr(at, stop - at);
        if (word.ends_with(':')) {
            word.pop_back();
        }
        if (pattern.match(word)) return true;
        at = stop + 1;
    }
    return false;
}

/// Reports that `show latency` has no line for the word at `index`.
void report_no_latency(Context& context, std::size_t index) {
    const std::string& word = context.argument(index);
    const Model& model = context.session.model();
    const Pin* const pin = model.find_pin(word);
    const Signal* const signal = pin ? pin->signal : model.find_signal(word);
    if (signal) {
        return context.diagnostics.error(
            "no-latency", context.span(index),
            "signal '" + signal->name + "' has no latency: it has no writer, or no reader", "",
            "see: show sig " + signal->name);
    }
    if (pin) {
        return context.diagnostics.error("no-latency", context.span(index),
                                         "pin '" + word + "' has no latency: it is not linked", "",
                                         "see: show pin " + word);
    }
    std::vector<std::string> names = names_of(model.signal);
    const auto pins = names_of(model.pin);
    names.insert(names.end(), pins.begin(), pins.end());
    context.diagnostics.error("no-latency", context.span(index),
                              "no linked pin or signal '" + word + "'", did_you_mean(word, names),
                              "`show latency` lists the latencies of all signals");
}

}  // namespace

void show_latency(Context& context) {
    const std::vector<std::string> words = words_of(context);
    const auto lines = context.shell.latencies();
    std::vector<bool> shown(lines.size(), words.empty());
    for (std::size_t i = 0; i < words.size(); ++i) {
        const Patterns pattern({words[i]});
        bool any = false;
        for (std::size_t line = 0; line < lines.size(); ++line) {
            if (!is_about(lines[line], pattern)) continue;
            any = true;
            shown[line] = true;
        }
        if (!any) {
            report_no_latency(context, i + 1);
        }
    }
    std::string text;
    auto rows = nlohmann::ordered_json::array();
    for (std::size_t line = 0; line < lines.size(); ++line) {
        if (!shown[line]) continue;
        text += lines[line] + "\n";
        rows.push_back(lines[line]);
    }
    if (context.diagnostics.failed()) return;
    if (context.options().json) {
        text = json_text(rows) + "\n";
    } else if (lines.empty()) {
        text = "no signal links a writer to a reader\n";
    }
    context.output.out(text);
}

namespace {

/// How many faults are not acknowledged, and which of them can be.
std::string acknowledgement_text(const Context& context) {
    const std::uint64_t count = unacknowledged(context);
    const std::uint64_t lasting = std::min(count, context.session.reports().lasting_count());
    if (lasting == 0) {
        return fmt::format("{} not acknowledged; `fault clear` acknowledges them\n", count);
    }
    const char* const verb = lasting == 1 ? "lasts" : "last";
    if (lasting == count) {
        return fmt::format(
            "{} not acknowledged; {} {}: type `fault clear` once the cause is over\n", count,
            lasting, verb);
    }
    return fmt::format("{} not acknowledged; {} {}, `fault clear` acknowledges the others\n", count,
                       lasting, verb);
}

}  // namespace

void show_faults(Context& context) {
    if (context.count() > 1) {
        return context.diagnostics.error("wrong-arguments", context.span(1),
                                         "`show fault` lists all faults, and has no argument", "",
                                         "see: help show");
    }
    const Reports& reports = context.session.reports();
    const auto records =
        context.script.clears_faults() ? reports.lasting_faults() : reports.faults();
    std::string text;
    if (context.options().json) {
        auto rows = nlohmann::ordered_json::array();
        for (const auto& record : records) {
            rows.push_back({{"number", record.number},
                            {"age_ns", record.age_ns},
                            {"cycle", record.cycle},
                            {"count", record.count},
                            {"span_ns", record.span_ns},
                            {"thread", record.thread},
                            {"code", record.code},
                            {"lasts", record.lasts},
                            {"sentence", record.sentence}});
        }
        return context.output.out(json_text(rows) + "\n");
    }
    for (const auto& record : records) {
        text += fmt::format("{:>4}  {} ago{}  {}\n", record.number,
                            format_duration(static_cast<double>(record.age_ns)),
                            record.lasts ? " (lasts)" : "", record.line());
    }
    if (records.empty()) {
        text = "no faults\n";
    } else {
        text += acknowledgement_text(context);
    }
    context.output.out(text);
}

namespace {

/// A fault whose condition lasts is not acknowledged.
void report_lasting(const std::vector<FaultRecord>& lasting, Span span, Diagnostics& diagnostics) {
    constexpr std::size_t max_named = 8;
    if (lasting.empty()) return;
    std::string text = fmt::format("{} faults last and are not acknowledged:", lasting.size());
    if (lasting.size() == 1) {
        text = "1 fault lasts and is not acknowledged:";
    }
    for (std::size_t i = 0; i < std::min(lasting.size(), max_named); ++i) {
        text += (i == 0 ? " " : "; ") + lasting[i].subject();
    }
    if (lasting.size() > max_named) {
        text += fmt::format("; {} more", lasting.size() - max_named);
    }
    diagnostics.warning("lasting-fault", span, text, "",
                        "see: show fault; once the cause is over, type: fault clear");
}

}  // namespace

void command_fault(Context& context) {
    Session& session = context.session;
    if (context.argument(0) == "clear") {
        if (context.checking()) return;
        context.script.note_fault_clear();
        return context.transaction->when_committed(
            [&session, &diagnostics = context.diagnostics, span = context.command.span] {
            report_lasting(session.reports().clear_faults(), span, diagnostics);
        });
    }
    context.diagnostics.error("unknown-word", context.span(0),
                              "'" + context.argument(0) + "' is not an action on faults", "",
                              "type `fault clear`; `show fault` lists the faults");
}

}  // namespace hal
