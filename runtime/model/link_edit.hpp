// SPDX-License-Identifier: MIT
// The edits of signals, links, values and aliases.
#pragma once

#include <string>
#include <string_view>

#include "model/absence.hpp"
#include "model/edit_log.hpp"
#include "model/names.hpp"

namespace hal {

/// The arrow written before a pin in a `net` line.
enum class Arrow { none, to_pin, from_pin, both };

/// A base of Edit.
class LinkEdit : public EditLog {
public:
    Signal* add_signal(Word name, hal_type type, Span typed_at);
    bool remove_signal(Word name);
    bool remove_all_signals();
    /// Links a pin to a signal if the rules allow it. Accepts a pin that is already linked to this
    /// signal.
    bool link(Pin& pin, Signal& signal, Word pin_word, Arrow arrow);
    void unlink(Pin& pin);

    bool set_pin(Word name, Word value);
    bool set_signal(Word name, Word value);

    /// Gives a pin its second name, in place of the one that it has.
    bool alias(Word name, Word second);
    /// Removes the second name; a pin that has none stays as it is.
    bool unalias(Word name);

    /// Checks that a netlist can contain the name of a new signal, alias, thread or instance.
    /// Returns false after reporting.
    bool check_name(const char* kind, Word name);

    // --- look-ups that report ---
    Pin* pin(Word name);
    Signal* signal(Word name);
    LoadedFunction* function(Word name);
    Thread* thread(Word name);
    /// What could not be made: a missing pin, function or the like of it is not an error again.
    Absences& absences() { return absences_; }
    bool is_absent(std::string_view name, Absences::Kind kind) {
        return absences_.explains(name, kind, model_);
    }

protected:
    explicit LinkEdit(Model& model) : LinkEdit(model, own_) {}
    LinkEdit(Model& model, Absences& absences) : EditLog(model), absences_(absences) {}
    ~LinkEdit() = default;

private:
    bool check_link(const Pin& pin, const Signal& signal, Word word);
    bool check_writers(const Pin& pin, const Signal& signal, Word word);
    void keep_signal_value(Pin& pin, const Signal& signal);
    bool check_settable(const Pin& pin, Word name, Word value);
    bool allocate_port(Signal& signal, Word name, Word value);
    void change_alias(Pin& pin, std::string alias);
    void warn_of_wrap(Word value, hal_type type, const Parsed& parsed);
    void unknown_name(Code code, Word name, const char* what, NameGroup group, std::string help);
    void keep_value(Pin& pin);

    Absences own_;
    Absences& absences_;
};

/// The types of `type` have a conversion component: "conv_s32_float", or empty.
std::string conversion(hal_type from, hal_type to);

}  // namespace hal
