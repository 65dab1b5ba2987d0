// SPDX-License-Identifier: MIT
// Edits of the model as one transaction: every rule a single edit can break is checked here, with
// the place of every word; everything can be rolled back. LinuxCNC's rules
// (docs/linuxcnc-compatibility.md).
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "model/link_edit.hpp"
#include "model/model.hpp"

namespace hal {

/// All edits: those of LinkEdit, and those of components, instances, functions and threads.
class Edit : public LinkEdit {
public:
    explicit Edit(Model& model) : LinkEdit(model) {}
    /// With absences that outlive the edit.
    Edit(Model& model, Absences& absences) : LinkEdit(model, absences) {}

    // --- functions and threads ---
    Thread* add_thread(Word name, const ThreadOptions& options);
    bool remove_thread(Word name);
    /// `position` as addf has it: appended (-1 or none), n from the front, -n from the end, never
    /// 0.
    bool add_function(Word function, Word thread, int position, Span position_at, bool init);
    bool remove_function(Word function, Word thread);
    void take_from_thread(LoadedFunction& function);

    // --- components and instances ---
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
    /// Takes an instance out of the model with its pins, its functions and all their links.
    void remove_instance(Instance& instance);
    void remove_component(LoadedComponent& component);
    void add_time_pins(LoadedFunction& function);
    /// Exchanges a component's code and instances with those of `fresh`, which was made beside the
    /// model and has an instance for each. Pins and functions that both declare stay the same
    /// objects: links, values, places in threads and times are kept. False after reporting what
    /// stands against it; then `fresh` is as it was.
    bool replace(LoadedComponent& component, std::unique_ptr<LoadedComponent>& fresh, Span at);

private:
    struct LeavingFunctions;

    /// Returns which functions leave with the instance, and which lose only its steps.
    static LeavingFunctions functions_leaving_with(const Instance& leaving);
    /// Takes the pins off their signals and the functions out of their threads. A signal that an
    /// output with a declared safe value wrote goes to that value.
    void unlink_for_removal(Instance& leaving, const LeavingFunctions& functions);
    static void drop_steps_of(const Instance& leaving, LoadedFunction& function) noexcept;
    /// Undoes remove_instance().
    void bring_back(Instance& instance, std::ptrdiff_t position, const LeavingFunctions& functions);
    /// Reports why a thread cannot have this name: an invalid one, or one that it or a pin of it
    /// would share.
    bool is_free_for_thread(Word name);
    bool name_free(std::string_view name, Span at, const char* what);
    bool names_free(const Instance& of, const std::vector<std::unique_ptr<Pin>>& pins,
                    const std::vector<std::unique_ptr<LoadedFunction>>& functions);
    void enter_functions(LoadedComponent& component, std::size_t before);
    void withdraw_functions(LoadedComponent& of, std::size_t before);
    bool check_function(const LoadedFunction& function, const Thread& thread, Span at, bool init);
};

}  // namespace hal
