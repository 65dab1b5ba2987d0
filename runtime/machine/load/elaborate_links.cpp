// SPDX-License-Identifier: MIT
// Signals, links, values and aliases: net, newsig, delsig, the link commands, unlinkp, setp, sets,
// alias and unalias.
#include <algorithm>
#include <iterator>

#include "machine/load/elaborate.hpp"
#include "text/quoting.hpp"

namespace hal {

using edits::Args;
using edits::word;

/// `net SIGNAL PIN…`: links the pins, and makes the signal with the type of the first one. Arrows
/// between the pins are checked with the direction of the pin behind them. A signal of unknown
/// type, because its pins belong to a missing component, is noted as absent.
void edits::net(Elaboration& on, Args args) {
    struct Wanted {
        Pin* pin;
        const Token* token;
        Arrow arrow;
    };
    std::vector<Wanted> wanted;
    bool unknown_type = false;
    std::optional<Absences::Cause> cause;  // of the first pin's absence
    Arrow arrow = Arrow::none;
    for (const Token& token : args.subspan(1)) {
        if (is_arrow(token.text)) {
            if (token.text == "=>") {
                arrow = Arrow::to_pin;
            } else if (token.text == "<=") {
                arrow = Arrow::from_pin;
            } else {
                arrow = Arrow::both;
            }
            continue;
        }
        if (Pin* const pin = on.edit.pin(word(token))) {
            wanted.push_back({pin, &token, arrow});
        } else if (on.edit.is_absent(token.text, Absences::Kind::pin)) {
            unknown_type = true;
            cause = on.edit.absences().last();
        }
    }
    Signal* signal = on.model.find_signal(args[0].text);
    if (!signal && unknown_type) return on.edit.absences().note(args[0].text, cause);
    if (!signal) {
        if (on.model.find_pin(args[0].text)) {
            on.diagnostics.error(
                "signal-named-like-pin", args[0].span,
                "signal name " + hal::quoted(args[0].text) + " is the name of a pin", "a pin",
                "write the signal's name first: net SIGNAL " + args[0].text);
            return;
        }
        if (wanted.empty()) {
            on.edit.absences().note(args[0].text);
            return;
        }
        signal =
            on.edit.add_signal(word(args[0]), wanted.front().pin->type, wanted.front().token->span);
        if (!signal) return;
    }
    for (const Wanted& one : wanted) {
        on.edit.link(*one.pin, *signal, word(*one.token), one.arrow);
    }
}

void edits::newsig(Elaboration& on, Args args) {
    const auto type = type_named(args[1].text);
    if (!type) {
        std::vector<std::string> all;
        for (const TypeRow& row : types) {
            all.emplace_back(row.name);
        }
        on.diagnostics.error("no-such-type", args[1].span,
                             "unknown type " + hal::quoted(args[1].text),
                             did_you_mean(args[1].text, all), "types: " + listed(all));
        return;
    }
    on.edit.add_signal(word(args[0]), *type, args[1].span);
}

void edits::delsig(Elaboration& on, Args args) {
    if (args[0].text == "all") {
        on.edit.remove_all_signals();
    } else {
        on.edit.remove_signal(word(args[0]));
    }
}

namespace {

/// The arguments of a command in which arrows are allowed and without meaning.
std::vector<Token> without_arrows(Args args) {
    std::vector<Token> rest;
    std::copy_if(args.begin(), args.end(), std::back_inserter(rest),
                 [](const Token& token) { return !is_arrow(token.text); });
    return rest;
}

void link(Elaboration& on, const Token& pin_token, const Token& signal_token) {
    Pin* const pin = on.edit.pin(word(pin_token));
    Signal* const signal = on.edit.signal(word(signal_token));
    if (pin && signal) {
        on.edit.link(*pin, *signal, word(pin_token), Arrow::none);
    }
}

}  // namespace

void edits::linkps(Elaboration& on, Args args) {
    const auto words = without_arrows(args);
    link(on, words[0], words[1]);
}

void edits::linksp(Elaboration& on, Args args) {
    const auto words = without_arrows(args);
    link(on, words[1], words[0]);
}

void edits::linkpp(Elaboration& on, Args args) {
    const auto words = without_arrows(args);
    Pin* const first = on.edit.pin(word(words[0]));
    Pin* const second = on.edit.pin(word(words[1]));
    if (!first || !second) return;
    for (const auto& [pin, at] : {std::pair(first, words[0]), std::pair(second, words[1])}) {
        if (!pin->signal) continue;
        Diagnostic d{Severity::error,
                     "pin-linked",
                     "pin " + hal::quoted(at.text) + " is already linked to signal " +
                         hal::quoted(pin->signal->name),
                     {{at.span, "linked"}},
                     {"link the other pin to that signal: net " + pin->signal->name + " " +
                      (pin == first ? words[1] : words[0]).text}};
        if (pin->linked_at.known()) {
            d.labels.push_back({pin->linked_at, "linked here"});
        }
        on.diagnostics.add(std::move(d));
        return;
    }
    // the signal carries the first pin's name, as LinuxCNC does it; here '-sig' keeps the two apart
    Signal* const signal =
        on.edit.add_signal({first->name + "-sig", words[0].span}, first->type, words[0].span);
    if (!signal) return;
    on.edit.link(*first, *signal, word(words[0]), Arrow::none);
    on.edit.link(*second, *signal, word(words[1]), Arrow::none);
}

void edits::unlinkp(Elaboration& on, Args args) {
    if (Pin* const pin = on.edit.pin(word(args[0]))) {
        on.edit.unlink(*pin);
    }
}

void edits::setp(Elaboration& on, Args args) { on.edit.set_pin(word(args[0]), word(args[1])); }
void edits::sets(Elaboration& on, Args args) { on.edit.set_signal(word(args[0]), word(args[1])); }

namespace {

/// The first word of alias and unalias. False after reporting.
bool has_aliases(Elaboration& on, const Token& kind) {
    if (kind.text == "pin" || kind.text == "param" || kind.text == "parameter") return true;
    on.diagnostics.error("wrong-arguments", kind.span,
                         hal::quoted(kind.text) + " is not a kind of name that has aliases",
                         "pin or param", to_string(on.usage));
    return false;
}

}  // namespace

void edits::alias(Elaboration& on, Args args) {
    if (has_aliases(on, args[0])) {
        on.edit.alias(word(args[1]), word(args[2]));
    }
}

void edits::unalias(Elaboration& on, Args args) {
    if (has_aliases(on, args[0])) {
        on.edit.unalias(word(args[1]));
    }
}

}  // namespace hal
