// SPDX-License-Identifier: MIT
#include "mobile/texts/step_text.hpp"

#include <algorithm>

#include "text/characters.hpp"
#include "text/numbers.hpp"
#include "text/suggest.hpp"

namespace hal::mobile {

namespace {

using Words = std::vector<text::Word>;

bool is_name(const std::string& name) {
    return !name.empty() && name.size() <= 40 && std::all_of(name.begin(), name.end(), [](char c) {
        return (is_alphanumeric(c) && c == lower(c)) || c == '-';
    });
}

/// Reads one text; targets of transitions are resolved at the end, so that they may be written
/// before their steps.
class Reader {
public:
    explicit Reader(StepText& to) : to_(to) {}

    void line(const Words& words) {
        const std::string& key = words[0].text;
        if (key == "input") return names(words, to_.inputs);
        if (key == "output") return names(words, to_.outputs);
        if (key == "step") return step(words);
        if (key == "at") return timed(words, to_.alarms);
        if (key != "set" && key != "when" && key != "after") {
            return reject(words[0], "unknown key '" + key.substr(0, 60) + "'",
                          "a program has lines input, output, step, set, when, after and at");
        }
        if (to_.steps.empty()) {
            return reject(words[0], "'" + key + "' before the first step",
                          "write step NAME above it");
        }
        if (key == "set") return set(words);
        if (key == "after") return timed(words, to_.steps.back().transitions);
        when(words);
    }
    void resolve() {
        for (const Target& t : targets_) {
            const auto found = std::find_if(to_.steps.begin(), to_.steps.end(),
                                            [&](const Step& s) { return s.name == t.name.text; });
            if (found == to_.steps.end()) {
                std::vector<std::string> known;
                for (const Step& s : to_.steps) {
                    known.push_back(s.name);
                }
                reject(t.name, "unknown step '" + t.name.text.substr(0, 60) + "'",
                       hint(t.name.text, known,
                            "write step " + t.name.text.substr(0, 60) + " with its lines"));
                continue;
            }
            auto& list =
                t.step < 0 ? to_.alarms : to_.steps[static_cast<std::size_t>(t.step)].transitions;
            list[t.transition].to = static_cast<std::uint32_t>(found - to_.steps.begin());
        }
        std::stable_sort(
            to_.alarms.begin(), to_.alarms.end(),
            [](const Transition& a, const Transition& b) { return a.after_ns < b.after_ns; });
        if (to_.steps.empty() && to_.problems.empty()) {
            text::add(to_.problems, 0, 1, "the program has no steps",
                      "write step NAME and its lines");
        }
    }

private:
    struct Target {
        text::Word name;
        std::int64_t step;  ///< -1: of an alarm
        std::size_t transition;
    };
    void reject(const text::Word& word, std::string sentence, std::string help) {
        text::add(to_.problems, word.at.offset, word.at.offset + word.at.length,
                  std::move(sentence), std::move(help));
    }
    static std::string hint(const std::string& name, const std::vector<std::string>& known,
                            std::string otherwise) {
        std::string found = did_you_mean(name, known);
        return found.empty() ? otherwise : found;
    }
    void names(const Words& words, std::vector<std::string>& to) {
        for (std::size_t i = 1; i < words.size(); ++i) {
            const std::string& name = words[i].text;
            const auto taken = [&](const auto& list) {
                return std::find(list.begin(), list.end(), name) != list.end();
            };
            static const std::vector<std::string> own{"enable",    "reset", "step", "time",
                                                      "step-time", "and",   "not"};
            if (!is_name(name)) {
                reject(words[i], "invalid name '" + name.substr(0, 60) + "'",
                       "use a to z, 0 to 9 and '-'");
            } else if (taken(to_.inputs) || taken(to_.outputs)) {
                reject(words[i], "duplicate name '" + name + "'", "choose another name");
            } else if (taken(own)) {
                reject(words[i], "reserved name '" + name + "'", "choose another name");
            } else if (to.size() == StepText::max_bits) {
                reject(words[i], "more than 64 names", "split the program");
            } else {
                to.push_back(name);
            }
        }
        if (words.size() == 1) {
            reject(words[0], "'" + words[0].text + "' has no name",
                   "write " + words[0].text + " NAME ...");
        }
    }
    void step(const Words& words) {
        if (words.size() != 2 || !is_name(words[1].text)) {
            return reject(words.back(), "invalid step",
                          "write step NAME with a to z, 0 to 9 and '-'");
        }
        for (const Step& s : to_.steps) {
            if (s.name == words[1].text) {
                return reject(words[1], "duplicate step '" + s.name + "'", "choose another name");
            }
        }
        if (to_.steps.size() == StepText::max_steps) {
            return reject(words[1], "more than 128 steps", "split the program");
        }
        to_.steps.push_back({words[1].text, words[1].at, 0, {}});
    }
    /// The bit of a name, or 0 after a problem.
    std::uint64_t bit(const text::Word& word, const std::vector<std::string>& names,
                      const char* kind) {
        const auto found = std::find(names.begin(), names.end(), word.text);
        if (found != names.end()) {
            return std::uint64_t{1} << (found - names.begin());
        }
        reject(word, std::string("unknown ") + kind + " '" + word.text.substr(0, 60) + "'",
               hint(word.text, names,
                    std::string("write ") + kind + " " + word.text.substr(0, 60) +
                        " above the steps"));
        return 0;
    }
    void set(const Words& words) {
        if (words.size() == 1) return reject(words[0], "'set' has no output", "write set NAME ...");
        for (std::size_t i = 1; i < words.size(); ++i) {
            to_.steps.back().outputs |= bit(words[i], to_.outputs, "output");
        }
    }
    void target(const text::Word& name, const Transition& transition,
                std::vector<Transition>& list) {
        if (list.size() == StepText::max_transitions) {
            return reject(name, "more than 32 transitions", "split the step");
        }
        targets_.push_back(
            {name, &list == &to_.alarms ? -1 : static_cast<std::int64_t>(to_.steps.size()) - 1,
             list.size()});
        list.push_back(transition);
    }
    void timed(const Words& words, std::vector<Transition>& list) {
        const std::string form = "write " + words[0].text + " 1.5s -> STEP";
        if (words.size() != 4 || words[2].text != "->") {
            return reject(words.back(), "invalid transition", form);
        }
        const auto ns = parse_duration_ns(words[1].text, 0.0);
        if (!ns) {
            return reject(words[1], "'" + words[1].text.substr(0, 60) + "' is not a duration",
                          form);
        }
        Transition t;
        t.after_ns = *ns;
        target(words[3], t, list);
    }
    void when(const Words& words) {
        Transition t;
        std::size_t i = 1;
        const char* const form = "write when NAME and not NAME -> STEP";
        for (;;) {
            const bool inverted = i < words.size() && words[i].text == "not";
            if (inverted) {
                ++i;
            }
            if (i >= words.size() || words[i].text == "->") {
                return reject(words[std::min(i, words.size() - 1)], "missing condition", form);
            }
            (inverted ? t.must_not : t.must) |= bit(words[i++], to_.inputs, "input");
            if (i < words.size() && words[i].text == "and") {
                ++i;
                continue;
            }
            break;
        }
        if (i + 2 != words.size() || words[i].text != "->") {
            return reject(words[std::min(i, words.size() - 1)], "expected '-> STEP'", form);
        }
        target(words[i + 1], t, to_.steps.back().transitions);
    }

    StepText& to_;
    std::vector<Target> targets_;
};

}  // namespace

void StepText::read(std::string_view text) {
    Reader reader(*this);
    for (text::Lines lines(text); const auto line = lines.next();) {
        reader.line(text::words_of(*line));
    }
    reader.resolve();
}

}  // namespace hal::mobile
