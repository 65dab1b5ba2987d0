// SPDX-License-Identifier: MIT
// Candidates at the cursor: the row of the command determines the kind of word, the model the
// names.
#include <algorithm>
#include <filesystem>

#include <fmt/format.h>

#include "commands/completion.hpp"
#include "commands/files.hpp"
#include "commands/listing.hpp"
#include "commands/table.hpp"
#include "machine/processes/programs.hpp"
#include "text/fault_pages.hpp"
#include "text/natural_order.hpp"

namespace hal {
namespace {

constexpr std::size_t max_candidates = 100'000;  // of one answer

struct Search {
    const Session& session;
    const Programs& programs;
    const ShellOptions& options;
    /// before the one being typed, arrows left out, the command first
    std::vector<std::string> words;
    std::string typed;
    std::vector<Candidate>& found;

    const Model& model() const { return session.model(); }
    void add(const std::string& text, std::string hint = "") {
        if (text.starts_with(typed) && found.size() < max_candidates) {
            found.push_back({text, std::move(hint)});
        }
    }
    /// Returns whether the word is among those typed from word `from` on.
    bool is_typed(const std::string& word, std::size_t from = 0) const {
        return std::find(words.begin() + static_cast<std::ptrdiff_t>(std::min(from, words.size())),
                         words.end(), word) != words.end();
    }
    /// Adds each row of a table by its name.
    void add_names(const auto& rows) {
        for (const auto& row : rows) {
            add(std::string(row.name));
        }
    }
    void add_texts(const std::vector<std::string>& texts) {
        for (const std::string& text : texts) {
            add(text);
        }
    }
};

std::string hint_of(const Pin& pin) {
    std::string hint = std::string(name(pin.type)) + " " + direction_text(pin);
    return pin.signal ? hint + " " + arrow_of_pin(pin) + " " + pin.signal->name : hint;
}

template <class Wanted>
void add_pins(Search& search, Wanted&& wanted) {
    for (const auto& [key, pin] : search.model().pin) {
        if (wanted(*pin)) {
            search.add(std::string(key), hint_of(*pin));
        }
    }
}

template <class Wanted>
void add_signals(Search& search, Wanted&& wanted) {
    for (const auto& signal : search.model().signals) {
        if (wanted(*signal)) {
            search.add(signal->name,
                       fmt::format("{} {} pins", name(signal->type), signal->pins.size()));
        }
    }
}

template <class Wanted>
void add_functions(Search& search, Wanted&& wanted) {
    for (const auto& [key, function] : search.model().function) {
        if (wanted(*function)) {
            search.add(std::string(key), function->doc);
        }
    }
}

/// What is on a signal, or is to be: which pins may join it.
struct Connection {
    std::optional<hal_type> type;
    bool has_writer = false;
    bool has_io = false;

    explicit Connection(const Signal* signal) {
        if (!signal) return;
        type = signal->type;
        has_writer = signal->writer != nullptr;
        has_io = signal->ios > 0;
    }
    void add(const Pin& pin) {
        type = type.value_or(pin.type);
        has_writer |= pin.dir == HAL_DIR_OUT;
        has_io |= pin.dir == HAL_DIR_IO;
    }
    bool admits(const Pin& pin) const {
        if (pin.signal || (type && pin.type != *type)) return false;
        switch (pin.dir) {
        case HAL_DIR_IN: return true;
        case HAL_DIR_OUT: return !has_writer && !has_io;
        case HAL_DIR_IO: return !has_writer;
        default: return false;
        }
    }
};

/// After `net SIGNAL`: free pins that may go onto it beside what is on it, and beside the pins
/// typed so far.
void add_free_pins(Search& search) {
    const bool has_signal = search.words.size() > 1;
    Connection connection(has_signal ? search.model().find_signal(search.words[1]) : nullptr);
    for (std::size_t i = 2; i < search.words.size(); ++i) {
        if (const Pin* const pin = search.model().find_pin(search.words[i])) {
            connection.add(*pin);
        }
    }
    add_pins(search, [&](const Pin& pin) {
        return connection.admits(pin) && !search.is_typed(pin.name, 2);
    });
}

void add_files(Search& search) {
    const auto slash = search.typed.rfind('/');
    const std::string folder = slash == search.typed.npos ? "" : search.typed.substr(0, slash + 1);
    const std::string where = resolve_path(folder.empty() ? "." : folder, search.options.directory);
    std::error_code problem;
    for (std::filesystem::directory_iterator entry(where, problem), end; !problem && entry != end;
         entry.increment(problem)) {
        const bool directory = entry->is_directory(problem);
        search.add(folder + entry->path().filename().string() + (directory ? "/" : ""),
                   directory ? "folder" : "");
    }
}

/// Values: what a bit may be.
void add_values(Search& search) {
    const std::string& name = search.words[1];
    const auto is_bit = [](const auto* one) { return one && one->type == HAL_TYPE_BIT; };
    const bool bit = search.words[0] == "sets" ? is_bit(search.model().find_signal(name))
                                               : is_bit(search.model().find_pin(name));
    if (bit) {
        search.add_texts({"TRUE", "FALSE"});
    }
}

/// Names that `show KIND`, `list KIND` can be asked for.
void add_listed(Search& search) {
    const std::string kind = search.words.size() > 1 ? search.words[1] : "";
    if (kind.starts_with("pin")) {
        add_pins(search, [](const Pin& pin) { return !is_parameter(pin); });
    } else if (kind.starts_with("param")) {
        add_pins(search, [](const Pin& pin) { return is_parameter(pin); });
    } else if (kind.starts_with("sig")) {
        add_signals(search, [](const Signal&) { return true; });
    } else if (kind.starts_with("funct")) {
        add_functions(search, [](const LoadedFunction&) { return true; });
    } else if (kind == "thread" || kind == "timing") {
        for (const auto& thread : search.model().threads) {
            search.add(thread->name);
        }
    } else if (kind == "comp") {
        for (const auto& component : search.model().components) {
            search.add(component->name);
        }
    } else if (kind == "alias") {
        add_pins(search, [](const Pin& pin) { return !pin.alias.empty(); });
    }
}

void add_load_arguments(Search& search) {
    const auto declared =
        search.words.size() > 1 ? search.session.host().declared(search.words[1]) : std::nullopt;
    if (declared) {
        for (const auto& argument : declared->arguments) {
            search.add(argument.name + "=", argument.doc);
        }
    }
    if (declared && (declared->singleton || declared->whole_names)) return;
    for (const char* argument : {"names=", "count=", "num_chan=", "personality="}) {
        search.add(argument);
    }
}

struct Kind {
    std::string_view word;
    void (*add)(Search&);
};

/// The words in capitals of the command table, each with where its names come from.
constexpr Kind kinds[] = {
    {"COMPONENT",
     [](Search& s) {
    if (s.words[0] == "loadrt") {
        for (const auto& name : s.session.host().available_components()) {
            s.add(name);
        }
        return;
    }
    const bool programs = s.words[0] != "reload";
    for (const auto& c : s.model().components) {
        if (programs || c->plugin) {
            s.add(c->name,
                  c->process ? "program" : fmt::format("{} instances", c->instances.size()));
        }
    }
}},
    {"INSTANCE",
     [](Search& s) {
    for (const auto& [name, instance] : s.model().instance) {
        s.add(std::string(name), instance->component->name);
    }
}},
    {"ARGUMENT=VALUE", add_load_arguments},
    {"PROCESS", [](Search& s) { s.add_texts(s.programs.names()); }},
    {"PROGRAM", add_files},
    {"FILE", add_files},
    {"FUNCTION",
     [](Search& s) {
    const bool placed = s.words[0] == "delf";
    add_functions(s, [&](const LoadedFunction& f) {
        return (f.thread != nullptr) == placed && !s.is_typed(f.name);
    });
}},
    {"THREAD",
     [](Search& s) {
    const LoadedFunction* const function =
        s.words[0] == "delf" && s.words.size() > 1 ? s.model().find_function(s.words[1]) : nullptr;
    for (const auto& thread : s.model().threads) {
        if (!function || function->thread == thread.get()) {
            s.add(thread->name, format_duration(static_cast<double>(thread->options.period_ns)));
        }
    }
}},
    {"SIGNAL",
     [](Search& s) {
    const bool settable = s.words[0] == "sets";
    add_signals(
        s, [&](const Signal& signal) { return !settable || (!signal.writer && signal.ios == 0); });
}},
    {"PIN",
     [](Search& s) {
    // net and linksp have named the signal already; linkps PIN SIGNAL and linkpp take any free
    // pin
    if (s.words[0] == "net" || s.words[0] == "linksp") {
        add_free_pins(s);
    } else if (s.words[0] == "unlinkp") {
        add_pins(s, [](const Pin& pin) { return pin.signal != nullptr; });
    } else {
        add_pins(s, [](const Pin& pin) { return !pin.signal && pin.dir != HAL_DIR_PARAM; });
    }
}},
    {"PIN-OR-PARAMETER",
     [](Search& s) {
    if (s.words[0] == "setp") {
        return add_pins(s, [](const Pin& pin) {
            return pin.dir != HAL_DIR_OUT && !pin.read_only() && !pin.signal;
        });
    }
    const bool aliasing = s.words[0] == "alias" && s.words.size() > 1;
    add_pins(s, [&](const Pin& pin) {
        return !aliasing || (is_parameter(pin) == (s.words[1] == "param") && pin.alias.empty());
    });
}},
    {"ALIAS",
     [](Search& s) {
    for (const auto& [key, pin] : s.model().pin) {
        if (key == pin->alias) {
            s.add(std::string(key), pin->name);
        }
    }
}},
    {"VALUE", add_values},
    {"TYPE", [](Search& s) { s.add_names(types); }},
    {"PATTERN", add_listed},
    {"COMMAND",
     [](Search& s) {
    for (const auto& row : command_table()) {
        if (!row.is_for_tests()) {
            s.add(row.name, row.summary);
        }
    }
}},
    {"CODE", [](Search& s) { s.add_names(all_code_pages()); }},
};

void add_word(Search& search, std::string_view word) {
    bool choices = false;
    for (std::size_t at = 0;
         at <= word.size();) {  // "COMPONENT|all", "[comp|pin|…]", or one word alone
        const auto bar = std::min(word.find('|', at), word.size());
        const std::string_view one = word.substr(at, bar - at);
        const auto kind = std::find_if(std::begin(kinds), std::end(kinds),
                                       [&](const Kind& k) { return k.word == one; });
        const bool literal =
            one.find_first_of("ABCDEFGHIJKLMNOPQRSTUVWXYZ") == one.npos || one.starts_with('-');
        choices = choices || bar < word.size();
        if (kind != std::end(kinds)) {
            kind->add(search);
        } else if (const auto equals = one.find('='); equals != one.npos) {
            return search.add(std::string(one.substr(0, equals + 1)));
        } else if (literal) {
            search.add(std::string(one));
        }
        at = bar + 1;
    }
}

/// Returns whether a typed word may be this word of the usage.
bool accepts(const UsageWord& word, const std::string& typed) {
    if (word.text.starts_with('-')) return word.text == typed;
    return word.of_option || !typed.starts_with('-');
}

/// Follows the usage through the words typed so far and offers every word that may come next:
/// optional ones can be left out, repeated ones stay, an option's own argument comes only after the
/// option.
void add_arguments(Search& search, const std::vector<UsageWord>& words) {
    std::vector<bool> here(words.size() + 1), next;
    const auto reach = [&](std::vector<bool>& states, std::size_t i) {
        while (true) {
            states[i] = true;
            if (i == words.size() || !words[i].optional || words[i].of_option) return;
            do {
                ++i;
            } while (i < words.size() && words[i].of_option);
        }
    };
    reach(here, 0);
    for (std::size_t given = 1; given < search.words.size(); ++given) {
        next.assign(words.size() + 1, false);
        for (std::size_t i = 0; i < words.size(); ++i) {
            if (!here[i] || !accepts(words[i], search.words[given])) continue;
            if (words[i].repeats) {
                reach(next, i);
            }
            if (i + 1 < words.size() && words[i + 1].of_option) {
                next[i + 1] = true;
            } else {
                reach(next, i + 1);
            }
        }
        here.swap(next);
    }
    for (std::size_t i = 0; i < words.size(); ++i) {
        if (here[i]) {
            add_word(search, words[i].text);
        }
    }
}

}  // namespace

Completion complete_line(Session& session, const ShellOptions& options, std::string_view line,
                         std::size_t cursor) {
    line = line.substr(0, std::min(cursor, line.size()));
    Completion completion;
    const auto last = line.find_last_of(" \t");
    completion.begin = last == line.npos ? 0 : last + 1;

    const auto lock = session.lock();
    const std::string begun(line.substr(completion.begin));
    Search search{.session = session,
                  .programs = session.programs(),
                  .options = options,
                  .words = {},
                  .typed = begun,
                  .found = completion.candidates};
    for (std::size_t at = 0; at < completion.begin;) {
        const auto end = std::min(line.find_first_of(" \t", at), completion.begin);
        if (end > at && !is_arrow(line.substr(at, end - at))) {
            search.words.emplace_back(line.substr(at, end - at));
        }
        at = end + 1;
    }
    if (search.words.empty()) {
        for (const auto& row : command_table()) {
            if (row.is_for_tests()) continue;
            search.add(row.name, row.summary);
            if (*row.also) {
                search.add(row.also, row.summary);
            }
        }
    } else if (const CommandRow* const row = find_command(search.words[0])) {
        for (const auto& form : usage_forms(row->arguments)) {
            add_arguments(search, form);
        }
    }
    auto& found = completion.candidates;
    std::sort(found.begin(), found.end(),
              [](const Candidate& a, const Candidate& b) { return natural_less(a.text, b.text); });
    found.erase(
        std::unique(found.begin(), found.end(),
                    [](const Candidate& a, const Candidate& b) { return a.text == b.text; }),
        found.end());
    return completion;
}

}  // namespace hal
