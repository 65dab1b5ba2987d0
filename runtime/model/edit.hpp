// SPDX-License-Identifier: MIT
// Edits of the model as one transaction: every rule a single edit can break is checked here, with
// the place of every word; everything can be rolled back. LinuxCNC's rules
// (docs/linuxcnc-compatibility.md).
#pragma once

#include <algorithm>
#include <deque>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "model/absence.hpp"
#include "model/model.hpp"
#include "model/names.hpp"
#include "text/diagnostic.hpp"

namespace hal {

/// A word of a command with its place.
struct Word {
    std::string_view text;
    Span span;
};

/// The arrow written before a pin in a `net` line.
enum class Arrow { none, to_pin, from_pin, both };

class Edit {
public:
    explicit Edit(Model& model) : Edit(model, own_) {}
    /// With absences that outlive the edit.
    Edit(Model& model, Absences& absences) : model_(model), absences_(absences) {}
    Edit(const Edit&) = delete;

    Diagnostics* diagnostics = nullptr;  ///< where problems of the next edits go

    // --- signals and links ----------------------------------------------------------------------------------------
    Signal* add_signal(Word name, hal_type type, Span typed_at);
    bool remove_signal(Word name);
    bool remove_all_signals();
    /// Links a pin to a signal if the rules allow it. Accepts a pin that is already linked to this
    /// signal.
    bool link(Pin& pin, Signal& signal, Word pin_word, Arrow arrow);
    void unlink(Pin& pin);

    // --- values ---------------------------------------------------------------------------------------------------
    bool set_pin(Word name, Word value);
    bool set_signal(Word name, Word value);

    // --- functions and threads ------------------------------------------------------------------------------------
    Thread* add_thread(Word name, const ThreadOptions& options);
    bool remove_thread(Word name);
    /// `position` as addf has it: appended (-1 or none), n from the front, -n from the end, never 0.
    bool add_function(Word function, Word thread, int position, Span position_at, bool init);
    bool remove_function(Word function, Word thread);
    void take_from_thread(LoadedFunction& function);

    // --- names ------------------------------------------------------------------------------------------------------
    /// Gives a pin its second name, in place of the one that it has.
    bool alias(Word name, Word second);
    /// Removes the second name; a pin that has none stays as it is.
    bool unalias(Word name);

    // --- components and instances -----------------------------------------------------------------------------------
    LoadedComponent& add_component(std::string name, Span at);
    /// Takes an instance with its pins and functions into the indices; reports names that are
    /// taken. Leaves `instance` unchanged on failure.
    bool add_instance(LoadedComponent& component, std::unique_ptr<Instance>& instance,
                      std::vector<std::unique_ptr<LoadedFunction>> functions);
    /// An instance that this edit has added gets further pins and functions. Reports names that are
    /// taken.
    bool add_declared(Instance& instance, std::vector<std::unique_ptr<Pin>> pins,
                      std::vector<std::unique_ptr<LoadedFunction>> functions);
    /// A program's component gets pins; they belong to no thread, so no plan changes. Reports names
    /// that are taken.
    bool add_pins(Instance& instance, std::vector<std::unique_ptr<Pin>> pins, Span at);
    /// Removes pins of a program's component that are in no signal.
    void remove_pins(Instance& instance, const std::vector<Pin*>& pins);
    void set_process(LoadedComponent& component, std::int64_t process);
    /// The number of the next unnamed instance.
    std::uint32_t take_number(LoadedComponent& component);
    /// Puts a thread's functions into another order.
    void reorder(Thread& thread, std::vector<LoadedFunction*> functions);
    /// `loadrt` arguments as they were written, for `save`, and taken apart, for `reload`.
    void note_arguments(LoadedComponent& component, std::string text, Load load);
    /// A shared function gets one more instance.
    void extend_function(LoadedFunction& function, const plan::Step& step, Instance& instance);
    void remove_instance(Instance& instance);
    void remove_component(LoadedComponent& component);
    void add_time_pins(LoadedFunction& function);
    /// Exchanges a component's code and instances with those of `fresh`, which was made beside the
    /// model and has an instance for each. Pins and functions that both declare stay the same
    /// objects: links, values, places in threads and times are kept. False after reporting what
    /// stands against it; then `fresh` is as it was.
    bool replace(LoadedComponent& component, std::unique_ptr<LoadedComponent>& fresh, Span at);

    // --- look-ups that report ---------------------------------------------------------------------------------------
    Pin* pin(Word name);
    Signal* signal(Word name);
    LoadedFunction* function(Word name);
    Thread* thread(Word name);
    /// What could not be made: a missing pin, function or the like of it is not an error again.
    Absences& absences() { return absences_; }
    bool is_absent(std::string_view name, Absences::Kind kind) {
        return absences_.explains(name, kind, model_);
    }

    // --- what the transaction did -----------------------------------------------------------------------------------
    bool structural() const { return structural_; }
    bool changed() const {
        return structural_ || !pin_values.empty() || !signal_values.empty() || !undo_.empty();
    }
    void undo();
    /// Forgets how to undo; what was removed is handed over to be destroyed after the threads have
    /// let go of it.
    struct Removed {
        std::vector<std::unique_ptr<Instance>> instances;
        std::vector<std::unique_ptr<Pin>> pins;
        std::vector<std::unique_ptr<LoadedFunction>> functions;
        std::vector<std::unique_ptr<LoadedComponent>> components;
        std::vector<std::unique_ptr<Signal>> signals;
        std::vector<std::unique_ptr<Thread>> threads;
        std::vector<decltype(Signal::port)> ports;  ///< of a buffer that was rolled back
    };
    Removed& removed() { return removed_; }
    const std::vector<Instance*>& added_instances() const { return added_instances_; }
    /// A component that was replaced, and the one that is not in the model: the old one; after
    /// undo() the new one.
    struct Replaced {
        LoadedComponent* component;
        std::unique_ptr<LoadedComponent> other;
        bool stopped = false;  ///< the old instances have been stopped for the new ones
    };
    std::deque<Replaced>& replaced() { return replaced_; }

    // New values of what the threads own now; for the compiler (structural) or the write queues
    // (not).
    Notes<Pin, hal_value> pin_values;
    Notes<Signal, hal_value> signal_values;
    /// functions that this edit took from a thread; it may have put them into another one since
    const std::vector<LoadedFunction*>& taken_functions() const { return taken_; }
    /// Gives the outputs of functions that are in no thread any more their declared safe values.
    void make_taken_safe();
    Notes<Signal, Pin*> inherited;  ///< a signal that takes the value the pin has
    std::unordered_map<const Pin*, hal_pin*>
        old_memory;  ///< of pins that were replaced: what the threads know until they take the new plan
    /// Where a pin's value is now.
    const hal_pin& present(const Pin& pin) const {
        const auto old = old_memory.find(&pin);
        return old == old_memory.end() ? *pin.memory : *old->second;
    }

private:
    void change_alias(Pin& pin, std::string alias);
    void warn_of_wrap(Word value, hal_type type, const Parsed& parsed);
    bool unknown_name(Code code, Word name, const char* what, NameGroup group, std::string help);
    bool fail(Code code, Span at, std::string message, std::string label = "",
              std::string help = "");
    bool name_free(std::string_view name, Span at, const char* what);
    bool names_free(const Instance& of, const std::vector<std::unique_ptr<Pin>>& pins,
                    const std::vector<std::unique_ptr<LoadedFunction>>& functions);
    void enter_functions(LoadedComponent& component, std::size_t before);
    void withdraw_functions(LoadedComponent& of, std::size_t before);
    void keep_value(Pin& pin);
    // Memory may end at any line. So every edit first allocates the space that it needs, then
    // registers its undo action, and only then changes the model, without allocating; entries of an
    // index come last, and undoing copes with missing ones.
    template <class T>
    static void make_room(std::vector<T>& row, std::size_t more = 1) {
        if (row.capacity() - row.size() < more) {
            row.reserve(row.size() + std::max(more, row.size()));
        }
    }
    void on_undo(std::function<void()> action) { undo_.push_back(std::move(action)); }

    Model& model_;
    Absences own_;
    Absences& absences_;
    std::vector<std::function<void()>> undo_;
    Removed removed_;
    std::deque<Replaced> replaced_;
    std::vector<Instance*> added_instances_;
    std::vector<LoadedFunction*> taken_;
    bool structural_ = false;
};

/// The types of `type` have a conversion component: "conv_s32_float", or empty.
std::string conversion(hal_type from, hal_type to);

}  // namespace hal
