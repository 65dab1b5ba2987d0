// SPDX-License-Identifier: MIT
#include "machine/load/thread_options.hpp"

#include <algorithm>
#include <map>
#include <optional>
#include <utility>

#include "text/numbers.hpp"
#include "text/quoting.hpp"

namespace hal {
namespace {

constexpr std::int64_t shortest_period_ns = 1000;
constexpr std::int64_t max_period_ns = 1'000'000'000'000;

/// A period of 0 or below in `loadrt threads`, as LinuxCNC reads it.
bool is_no_period(std::string_view text) {
    const auto ns = parse_duration_ns(text, 1.0);
    return ns && *ns <= 0;
}

/// Returns what to write in place of an invalid period.
std::string period_help(std::string text) {
    std::replace(text.begin(), text.end(), ',', '.');
    const auto ns = parse_duration_ns(text, 1.0);
    if (ns && *ns >= shortest_period_ns && *ns <= max_period_ns) {
        return "write " + hal::quoted(text) + "; the decimal sign is a point";
    }
    return "write a period of 1us..1000s with its unit, as in 1ms, or in nanoseconds: 1000000";
}

bool set_period(NewThread& thread, std::string_view text, Span at, Diagnostics& diagnostics) {
    thread.period_at = at;
    const auto ns = parse_duration_ns(text, 1.0);
    if (ns && *ns >= shortest_period_ns && *ns <= max_period_ns) {
        thread.options.period_ns = *ns;
        return true;
    }
    diagnostics.error("bad-period", at, "'" + std::string(text) + "' is not a period", "",
                      period_help(std::string(text)));
    return false;
}

// Each of these sets an option of a thread, or returns false for an invalid value.

bool parse_between(std::string_view text, std::int64_t min, std::int64_t max, int& value) {
    std::int64_t number = 0;
    if (!parse_whole(text, number) || number < min || number > max) return false;
    value = static_cast<int>(number);
    return true;
}

bool parse_ns(std::string_view text, std::int64_t& value) {
    const auto ns = parse_duration_ns(text, 1.0);
    if (!ns || *ns < 0) return false;
    value = *ns;
    return true;
}

bool parse_fp(std::string_view, ThreadOptions&) { return true; }  // every thread has it

bool parse_cpu(std::string_view text, ThreadOptions& o) {
    return parse_between(text, 0, 1023, o.cpu);
}

bool parse_priority(std::string_view text, ThreadOptions& o) {
    return parse_between(text, 1, 99, o.priority);
}

bool parse_policy(std::string_view text, ThreadOptions& o) {
    static constexpr std::pair<std::string_view, Policy> names[] = {
        {"fifo", Policy::fifo}, {"deadline", Policy::deadline}, {"other", Policy::other}};
    const auto named = std::ranges::find(names, text, &std::pair<std::string_view, Policy>::first);
    if (named == std::end(names)) return false;
    o.policy = named->second;
    return true;
}

bool parse_spin(std::string_view text, ThreadOptions& o) { return parse_ns(text, o.spin_ns); }

bool parse_budget(std::string_view text, ThreadOptions& o) { return parse_ns(text, o.budget_ns); }

bool parse_supervise(std::string_view text, ThreadOptions& o) {
    if (text != "off") return parse_ns(text, o.supervise_ns);
    o.supervise_ns = 0;
    return true;
}

bool parse_profile(std::string_view text, ThreadOptions& o) {
    o.profile_every = text == "every";
    return o.profile_every || text == "sampled";
}

struct ThreadOption {
    const char* key;
    bool (*parse)(std::string_view value, ThreadOptions& options);
    const char* help;  ///< for a value that is not valid
};

constexpr ThreadOption thread_options[] = {
    {"fp", parse_fp, ""},
    {"cpu", parse_cpu, "cpu=0 is the first CPU"},
    {"priority", parse_priority, "SCHED_FIFO priorities are 1 to 99"},
    {"policy", parse_policy, "policy is fifo, deadline or other"},
    {"spin", parse_spin, "a time in ns, or with a unit: 20us"},
    {"budget", parse_budget, "a time in ns, or with a unit: 20us"},
    {"supervise", parse_supervise, "a time: supervise=200ms, or supervise=off"},
    {"profile", parse_profile, "profile is sampled or every"},
};

/// Sets the option of that key. `known` is false, and nothing is reported, for any other key.
bool set_option(NewThread& thread, std::string_view key, std::string_view value, Span at,
                Diagnostics& diagnostics, bool& known) {
    const auto option =
        std::ranges::find_if(thread_options, [&](const auto& o) { return key == o.key; });
    known = option != std::end(thread_options);
    if (!known) return true;
    if (!option->parse(value, thread.options)) {
        diagnostics.error("bad-argument", at,
                          "'" + std::string(value) + "' is not a value of " + std::string(key), "",
                          option->help);
        return false;
    }
    if (key == "supervise") {
        thread.supervise_at = at;
    }
    return true;
}

// A limit that every ordinary cycle exceeds would stop the thread at once. The period may be given
// behind it.
bool fits_period(const NewThread& thread, Diagnostics& diagnostics) {
    const ThreadOptions& o = thread.options;
    if (o.supervise_ns <= 0 || o.supervise_ns >= 3 * o.period_ns) return true;
    diagnostics.error(
        "bad-argument", thread.supervise_at,
        "a supervision limit of " + format_duration(static_cast<double>(o.supervise_ns)) +
            " is too short for a period of " + format_duration(static_cast<double>(o.period_ns)),
        "",
        "at least 3 periods: supervise=" + std::to_string(3 * o.period_ns) +
            "ns; supervise=off: no limit");
    return false;
}

/// Options that the policy of the thread leaves without effect.
void warn_of_ignored(const NewThread& thread, Diagnostics& diagnostics) {
    const ThreadOptions& o = thread.options;
    const auto warn = [&](const std::string& option, const std::string& why) {
        diagnostics.warning("ignored-option", thread.at,
                            option + " of thread '" + thread.name + "' has no effect: " + why, "",
                            "remove it, or choose policy=fifo");
    };
    if (o.policy == Policy::deadline && o.cpu >= 0) {
        warn("cpu=" + std::to_string(o.cpu), "a thread with policy=deadline runs on all CPUs");
    }
    if (o.policy != Policy::fifo && o.priority > 0) {
        warn("priority=" + std::to_string(o.priority), "only policy=fifo has priorities");
    }
}

/// Checks that the options of a thread fit each other.
bool check_options(const NewThread& thread, Diagnostics& diagnostics) {
    warn_of_ignored(thread, diagnostics);
    return fits_period(thread, diagnostics);
}

/// "period1=1000000"
struct NumberedOption {
    std::string_view key;
    std::int64_t number = 0;
    std::string_view value;
};

std::optional<NumberedOption> numbered_option(std::string_view text) {
    const auto equals = text.find('=');
    if (equals == std::string_view::npos) return std::nullopt;
    const auto digits = text.substr(0, equals).find_last_not_of("0123456789") + 1;
    NumberedOption option{text.substr(0, digits), 0, text.substr(equals + 1)};
    if (!parse_whole(text.substr(digits, equals - digits), option.number)) return std::nullopt;
    return option;
}

/// Sets an option of the thread with the number that the text names. Returns false after reporting.
bool set_numbered_option(std::map<std::int64_t, NewThread>& by_number, const Token& token,
                         Diagnostics& diagnostics) {
    const auto option = numbered_option(token.text);
    bool known = option.has_value();
    bool good = true;
    if (option) {
        NewThread& thread = by_number[option->number];
        if (option->key == "name") {
            thread.name = option->value;
            thread.at = token.span;
        } else if (option->key == "period" && is_no_period(option->value)) {
            thread.omitted = true;
        } else if (option->key == "period") {
            good = set_period(thread, option->value, token.span, diagnostics);
        } else {
            good = set_option(thread, option->key, option->value, token.span, diagnostics, known);
        }
    }
    if (known) return good;
    diagnostics.error("unknown-argument", token.span,
                      "threads has no argument '" + token.text + "'", "",
                      "arguments: name1=NAME period1=NS cpu1=N policy1=… spin1=… budget1=… "
                      "supervise1=…, then name2= and so on");
    return false;
}

/// `at`: of the command.
void set_defaults(NewThread& thread, std::int64_t number, Span at) {
    if (thread.name.empty()) {
        thread.name = "thread" + std::to_string(number);
    }
    if (!thread.at.known()) {
        thread.at = thread.period_at.known() ? thread.period_at : at;
    }
    if (thread.options.period_ns == 0) {
        thread.options.period_ns = 1'000'000;
    }
}

}  // namespace

bool parse_new_thread(std::span<const Token> args, NewThread& thread, Diagnostics& diagnostics) {
    thread.name = args[0].text;
    thread.at = args[0].span;
    bool good = set_period(thread, args[1].text, args[1].span, diagnostics);
    for (const Token& token : args.subspan(2)) {
        if (token.text == "fp" || token.text == "nofp") continue;
        const auto equals = token.text.find('=');
        bool known = false;
        if (equals != std::string::npos &&
            !set_option(thread, std::string_view(token.text).substr(0, equals),
                        std::string_view(token.text).substr(equals + 1), token.span, diagnostics,
                        known)) {
            good = false;
        } else if (!known) {
            diagnostics.error(
                "unknown-argument", token.span, "newthread has no option '" + token.text + "'", "",
                "options: fp nofp cpu= policy= priority= spin= budget= supervise= profile=every");
            good = false;
        }
    }
    return check_options(thread, diagnostics) && good;
}

bool parse_threads(std::span<const Token> args, Span at, std::vector<NewThread>& threads,
                   Diagnostics& diagnostics) {
    std::map<std::int64_t, NewThread> by_number;
    bool good = true;
    for (const Token& token : args) {
        good = set_numbered_option(by_number, token, diagnostics) && good;
    }
    if (by_number.empty()) {
        by_number[1];
    }
    for (auto& [number, thread] : by_number) {
        if (thread.omitted) continue;
        set_defaults(thread, number, at);
        good = check_options(thread, diagnostics) && good;
        threads.push_back(std::move(thread));
    }
    return good;
}

void fit_period(const Model& model, NewThread& thread, Diagnostics& diagnostics) {
    if (model.threads.empty()) return;
    const Thread& fastest = *model.threads.front();
    const std::int64_t base = fastest.options.period_ns;
    const std::int64_t wanted = thread.options.period_ns;
    if (wanted < base || wanted % base == 0) return;
    thread.options.period_ns = (wanted + base / 2) / base * base;
    diagnostics.warning("period-multiple", thread.period_at,
                        "a period of " + std::to_string(wanted) +
                            " ns is not a multiple of the fastest thread's (" + fastest.name +
                            ", " + std::to_string(base) + " ns)",
                        "taken as " + std::to_string(thread.options.period_ns),
                        "write " + std::to_string(thread.options.period_ns));
}

}  // namespace hal
