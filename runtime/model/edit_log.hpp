// SPDX-License-Identifier: MIT
// What the edits of one transaction have done to the model: how to undo it, what was removed, and
// which values the threads are to take.
#pragma once

#include <algorithm>
#include <cstddef>
#include <deque>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include "model/model.hpp"
#include "text/diagnostic.hpp"

namespace hal {

/// A word of a command with its place.
struct Word {
    std::string_view text;
    Span span;
};

/// The base of Edit, without any edit.
class EditLog {
public:
    EditLog(const EditLog&) = delete;

    Diagnostics* diagnostics = nullptr;  ///< where problems of the next edits go

    /// Returns true when threads need a new plan.
    bool structural() const { return structural_; }
    bool changed() const {
        const bool values = !pin_values.empty() || !signal_values.empty();
        return structural_ || values || !undo_.empty();
    }
    void undo();
    /// What was removed is handed over to be destroyed after the threads have let go of it.
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
        /// An instance of the model and the one that is not. The state of the machine is in the
        /// memory of the old version, or (`handed`) in that of the new one.
        struct Pair {
            Instance *kept, *other;
            bool handed = false;
        };
        std::vector<Pair> pairs = {};
        bool undone = false;  ///< the old version is in the model again
    };
    std::deque<Replaced>& replaced() { return replaced_; }
    /// Functions that this edit took from a thread; it may have put them into another one since.
    const std::vector<LoadedFunction*>& taken_functions() const { return taken_; }
    /// Gives the outputs of functions that are in no thread any more their declared safe values.
    void make_taken_safe();

    // New values of what the threads own now; for the compiler (structural) or the write queues
    // (not).
    Notes<Pin, hal_value> pin_values;
    Notes<Signal, hal_value> signal_values;
    Notes<Signal, Pin*> inherited;  ///< a signal that takes the value the pin has
    /// of pins that were replaced: what the threads know until they take the new plan
    std::unordered_map<const Pin*, hal_pin*> old_memory;
    /// Where a pin's value is now.
    const hal_pin& present(const Pin& pin) const {
        const auto old = old_memory.find(&pin);
        return old == old_memory.end() ? *pin.memory : *old->second;
    }

protected:
    explicit EditLog(Model& model) : model_(model) {}
    ~EditLog() = default;

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

    /// Reports an error. Returns false.
    bool fail(Code code, Span at, std::string message, std::string label = "",
              std::string help = "");
    /// The other of two places that an error is about; left out when it is unknown.
    struct Other {
        Span at;
        std::string label;
    };
    bool fail(Code code, Span at, std::string message, std::string label, Other other,
              std::string help = "");

    Model& model_;
    Removed removed_;
    std::deque<Replaced> replaced_;
    std::vector<Instance*> added_instances_;
    std::vector<LoadedFunction*> taken_;
    bool structural_ = false;

private:
    void make_safe(const Instance& instance);

    std::vector<std::function<void()>> undo_;
};

}  // namespace hal
