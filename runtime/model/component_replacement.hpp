// SPDX-License-Identifier: MIT
// `reload`: a component's code and instances are exchanged, what the netlist made of them stays.
//
// Pins and functions that the old and the new version both declare remain the same objects, so that
// signals, threads, aliases, times and fault records need not know. Everything is exchanged by
// swapping, so that undoing is the same swaps backwards.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "model/edit_log.hpp"
#include "model/model.hpp"

namespace hal {

/// All state of one replacement, so that it can be applied and rolled back.
class ComponentReplacement {
public:
    /// `fresh` was made beside the model and has an instance for each of `component`.
    ComponentReplacement(Model& model, LoadedComponent& component, LoadedComponent& fresh);

    /// Finds what stays, goes and comes, and reports what the machine uses and the new version does
    /// not have, as errors at `at`.
    void compare(const EditLog& edit, Span at);
    /// Pins and functions of the new version that the old one does not have.
    const std::vector<Pin*>& new_pins() const { return new_pins_; }
    const std::vector<LoadedFunction*>& new_functions() const { return new_functions_; }
    bool removes(const Pin& pin) const;
    /// The new version's rows refer to its own objects; from now on they refer to those the model
    /// will have.
    void translate();
    /// The new memory of pins that stay takes their values; `edit` notes the old memory of those
    /// that a thread has.
    void carry_values(EditLog& edit);
    void run() const;
    void back() const;

private:
    /// An object the model keeps (at `kept` of the old row) and its declaration in the new version
    /// (at `fresh` of the new row).
    struct Pair {
        std::size_t fresh, kept;
    };
    struct InstancePair {
        Instance *kept, *fresh;
        std::vector<Pair> pins;
    };

    template <class T>
    static std::vector<Pair> pairs_of(const std::vector<std::unique_ptr<T>>& old_row,
                                      const std::vector<std::unique_ptr<T>>& fresh_row,
                                      bool (*same)(const T&, const T&));
    template <class T>
    static void exchange(std::vector<std::unique_ptr<T>>& model_row,
                         std::vector<std::unique_ptr<T>>& other, const std::vector<Pair>& pairs);
    template <class T>
    static void exchange_back(std::vector<std::unique_ptr<T>>& model_row,
                              std::vector<std::unique_ptr<T>>& other,
                              const std::vector<Pair>& pairs);
    void exchange_kept_declarations() const;
    void conflict(const EditLog& edit, Span at, std::string message, Span other, const char* label,
                  std::string help) const;
    void vanish(Pin& pin, const std::string& why, const EditLog& edit, Span at);
    void compare_pins(const InstancePair& pair, const EditLog& edit, Span at);
    static void compare_variables(const InstancePair& pair, const EditLog& edit, Span at);
    void compare_functions(const EditLog& edit, Span at);

    Model& model_;
    LoadedComponent &component_, &other_;
    std::vector<InstancePair> instances_;
    std::vector<Pair> functions_;
    std::vector<Pin*> gone_pins_, new_pins_;
    std::vector<LoadedFunction*> gone_functions_, new_functions_;
};

}  // namespace hal
