// SPDX-License-Identifier: MIT
// The graph as data: components, instances, pins, signals, functions, threads, aliases, each with
// the span that made it. Edited by model/edit, checked by model/check, compiled by model/compile.
// Not synchronised: the session owns it.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "base/types.hpp"
#include "model/name_table.hpp"
#include "plan/plan.hpp"
#include "text/source.hpp"

namespace hal {

struct LoadedComponent;
struct Instance;
struct LoadedFunction;
struct Signal;
struct Thread;

struct Pin {
    std::string name;                ///< full name
    std::string alias;               ///< second name, or empty
    hal_type type = HAL_TYPE_BIT;
    hal_dir dir = HAL_DIR_IN;
    std::uint32_t flags = 0;         ///< HAL_PIN_…
    const char* doc = "";            ///< these three live in the model's pool of texts
    const char* unit = "";
    hal_value initial{};
    hal_value safe{};
    hal_pin* memory = nullptr;       ///< in the instance
    hal_value** pointer = nullptr;  ///< a second pointer to the slot, in the plugin's own memory
    Instance* instance = nullptr;  ///< nullptr: a pin of a thread or of a function's times
    /// the one function that uses it, or nullptr: all of the instance
    LoadedFunction* function = nullptr;
    Thread* of_thread = nullptr;  ///< pins of a thread itself
    Signal* signal = nullptr;
    Span linked_at;
    /// the arrow before it marks it as a reader / writer
    bool arrow_in = false;
    bool arrow_out = false;
    std::uint32_t id = 0;
    // Where it is now (set by the compiler when a plan has been taken; nullptr home: the session
    // owns it).
    Thread* home = nullptr;

    /// A parameter that only its component sets.
    bool read_only() const { return dir == HAL_DIR_PARAM && (flags & HAL_PIN_READ_ONLY); }
    /// An output that declares a safe value.
    bool safe_output() const { return dir == HAL_DIR_OUT && (flags & HAL_PIN_SAFE); }
};

struct Signal {
    std::string name;
    hal_type type = HAL_TYPE_BIT;
    std::vector<Pin*> pins;  ///< in order of linking
    Pin* writer = nullptr;  ///< the OUT pin
    bool had_writer = false;  ///< after the last commit
    std::uint32_t readers = 0;
    std::uint32_t ios = 0;
    /// kept here while no thread writes it (sets, inherited values)
    hal_value value{};
    std::unique_ptr<hal_port, void (*)(hal_port*)> port{nullptr, [](hal_port*) {}};
    Span made, typed;  ///< who made it; what gave it its type
    std::size_t index = 0;  ///< in Model::signals
    std::uint32_t id = 0;
    // Where it is now.
    Thread* home = nullptr;  ///< the writing thread, or nullptr
    /// in home's image, a shared cell, or the session's own (&value)
    hal_value* slot = nullptr;
    std::vector<std::pair<Thread*, hal_value*>> copies;  ///< reading threads' slots
    std::shared_ptr<hal_value> cell;  ///< when I/O pins of several threads share it
};

/// A function of a loaded component, which `addf` can put into a thread. (hal::Function is what a
/// component's author declares it by.)
struct LoadedFunction {
    std::string name;
    const char* doc = "";
    std::vector<plan::Step> steps;  ///< one, or one per instance of a shared function
    /// runs many calls of that step
    struct {
        hal_row run = nullptr;
        hal_step step = nullptr;
    } row;
    std::vector<Instance*> instances;  ///< whose steps these are, in the same order
    LoadedComponent* component = nullptr;
    bool shared = false;
    /// the instances' other functions do not work while this one is in no thread
    bool required = false;
    Thread* thread = nullptr;
    bool init = false;  ///< placed by initf rather than addf
    /// not run: a reload failed and the old instance did not start again
    bool halted = false;
    Span added;
    std::vector<std::unique_ptr<Pin>> pins;  ///< its .time, .tmax, .tmax-increased
    std::unique_ptr<plan::FunctionTimes> times = std::make_unique<plan::FunctionTimes>();
    std::uint32_t id = 0;
    bool was_in_thread = false;  ///< after the last commit
};

/// The delay of a pin's value on its path to or from another machine; hal/path_delay.h.
struct PathDelay {
    const Pin* pin = nullptr;
    std::string far;
    std::uint32_t cycles = 0;
    std::uint32_t round_trip = 0;
    std::int64_t worst_ns = 0;
};

struct Instance {
    std::string name;
    LoadedComponent* component = nullptr;
    void* memory = nullptr;
    std::shared_ptr<void> storage;  ///< the block several instances of one loadrt share
    struct Block {
        std::unique_ptr<char[]> memory;
        std::size_t bytes = 0;
        std::size_t used = 0;
    };
    std::vector<Block> blocks;  ///< what its constructor has allocated
    std::vector<plan::Memory> further;  ///< memory of others that its functions use
    /// State that a reload copies to the instance that replaces this one.
    struct Variable {
        std::string name;
        std::uint64_t type;
        void* memory;
        std::size_t bytes;
    };
    std::vector<Variable> variables;
    std::vector<std::unique_ptr<Pin>> pins;
    std::vector<LoadedFunction*> functions;
    std::vector<plan::Step> emergency;
    std::vector<std::pair<std::string, hal_stream*>> streams;
    std::vector<Pin*> finite;  ///< its declared-finite outputs
    bool constructed = false;
    bool started = false;
    bool own_threads = false;  ///< uses its pins in threads of its own, at any moment
    bool reads_supervision = false;  ///< it reads the progress of the supervisor
    std::size_t helpers = 0;  ///< pieces of work outside of the cycle, since its last start
    bool leads_clock = false;  ///< it disciplines the threads to an external clock reference
    Span loaded;
    /// which of the component's loads made it, as which of that load's instances
    std::size_t load = 0;
    std::size_t number = 0;
    std::vector<PathDelay> path_delays;  ///< while it is started
};

/// An argument of a loadrt, and how its constructors declare it.
struct LoadArgument {
    enum class Use {
        common,  ///< the same value for all instances
        per_instance,  ///< a comma list with an element per instance
        count,  ///< the number of instances
    };
    std::string value;
    Use use = Use::common;
};

/// What one loadrt gave its instances.
struct Load {
    std::vector<std::string> names;  ///< empty: numbered
    std::map<std::string, LoadArgument> arguments;
    std::vector<std::string> personalities;
};

/// A component that is loaded: a plugin, one the runtime provides itself (`threads`), or a
/// program's.
struct LoadedComponent {
    std::string name;  ///< as loadrt was given it
    const hal_component* plugin = nullptr;  ///< nullptr: built in
    std::shared_ptr<void> library;
    std::string path;
    std::vector<std::string> arguments;  ///< one text per loadrt, for `save`
    std::vector<Load> loads;  ///< the same, taken apart, for `save` and `reload`
    std::vector<std::unique_ptr<Instance>> instances;
    std::vector<std::unique_ptr<LoadedFunction>> functions;
    /// Pins of its instances without a function are used by the functions of all components that
    /// have this flag.
    bool shares_pins = false;
    std::uint32_t next_number = 0;  ///< of the next unnamed instance
    std::uint32_t id = 0;
    /// of a program's component: its process. Its instance, if any, has pins only
    std::int64_t process = 0;
    Span loaded;
};

enum class Policy { fifo, deadline, other };

struct ThreadOptions {
    std::int64_t period_ns = 0;
    int cpu = -1;  ///< -1: the runtime chooses
    Policy policy = Policy::fifo;
    int priority = 0;  ///< 0: by rate
    /// hybrid wait: spin this long before the deadline; -1: the default
    std::int64_t spin_ns = -1;
    std::int64_t budget_ns = 0;  ///< execution time that counts as a fault; 0: none
    /// longest time without a finished cycle; 0: not supervised; -1: the default
    std::int64_t supervise_ns = -1;

    /// The limit that takes effect: 10 periods or 100 ms, whichever is longer, when none was given.
    std::int64_t supervision_limit_ns() const {
#if defined(__SANITIZE_THREAD__)
        constexpr std::int64_t min = 1'000'000'000;  // its cycles take ten times as long
#else
        constexpr std::int64_t min = 100'000'000;
#endif
        if (supervise_ns >= 0) return supervise_ns;
        if (period_ns * 10 > min) return period_ns * 10;
        return min;
    }
    bool profile_every = false;  ///< time every function in every cycle
};

struct Thread {
    std::string name;
    ThreadOptions options;
    std::vector<LoadedFunction*> functions, init;
    bool init_done = false;
    /// `threads`, when loadrt made it; nullptr: newthread did
    LoadedComponent* component = nullptr;
    std::vector<std::unique_ptr<Pin>> pins;
    hal_pin time{};
    hal_pin tmax{};
    hal_pin tmax_increased{};
    hal_pin beat{};
    hal_pin missed{};
    hal_pin wakeup{};  ///< memory of `pins`
    std::uint32_t id = 0;  ///< the executor's number; 0 until it runs
    Span made;
};

/// What an edit notes about objects of the model. Who reads the model looks it up by a pointer to
/// const.
struct AddressHash {
    using is_transparent = void;
    std::size_t operator()(const void* object) const noexcept {
        return std::hash<const void*>{}(object);
    }
};
template <class Object, class Note>
using Notes = std::unordered_map<Object*, Note, AddressHash, std::equal_to<>>;

struct Model {
    std::vector<std::unique_ptr<LoadedComponent>> components;
    std::vector<std::unique_ptr<Signal>> signals;  ///< unordered: erased by swapping with the last
    std::vector<std::unique_ptr<Thread>> threads;  ///< fastest first
    NameTable<LoadedComponent> component;
    NameTable<Instance> instance;
    NameTable<Pin> pin;  ///< by name and by alias
    NameTable<Signal> signal;
    NameTable<LoadedFunction> function;
    NameTable<Thread> thread;

    Pin* find_pin(std::string_view name) const;
    Signal* find_signal(std::string_view name) const;
    LoadedFunction* find_function(std::string_view name) const;
    Thread* find_thread(std::string_view name) const;
    Instance* find_instance(std::string_view name) const;
    /// `-` and `_` are the same here
    LoadedComponent* find_component(std::string_view name) const;

    /// Enters a pin into the index by its name and alias.
    void enter(Pin& pin);
    /// Removes a pin from the index.
    void leave(const Pin& pin);

    std::vector<const Pin*> sorted_pins() const;  ///< by name; aliases not repeated
    std::vector<const Signal*> sorted_signals() const;
    std::vector<const LoadedFunction*> sorted_functions() const;

    /// Keeps a text for as long as the model lives; equal texts share.
    const char* keep(std::string_view text);
    /// Forgets the texts of keep() that no object uses any more, and marks in `in_use` the numbers
    /// of the sources of all spans.
    void sweep(std::vector<bool>& in_use);
    /// An empty model that shares the pool of texts and goes on with the numbers: what is made in
    /// it can move here.
    Model beside();

    /// of pins and functions, for fault records, and of signals; also increased by new aliases
    std::uint32_t next_id = 1;
    /// `show comp` numbers them as LinuxCNC does: real-time modules take every third
    std::uint32_t next_component_id = 7;

private:
    struct Texts;
    std::shared_ptr<Texts> texts_;
};

/// The thread whose functions use this pin now, or nullptr. Follows Pin::function, else the
/// instance's functions.
Thread* thread_of(const Pin& pin);

/// The pin's component declared loose pins: any of its functions may use it, in whichever thread.
bool is_loose(const Pin& pin);

}  // namespace hal
