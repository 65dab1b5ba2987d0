// SPDX-License-Identifier: MIT
// The host of a component's constructor: what it declares, asks for and reports is gathered here.
// Internal to construct.cpp.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <new>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "hal/assumed.h"
#include "hal/hardware.h"
#include "hal/modules.h"
#include "hal/naming.h"
#include "hal/pin_names.h"
#include "hal/retained.h"
#include "hal/texts.h"
#include "hal/unstarted.h"
#include "machine/load/construct.hpp"

namespace hal {

struct DeclaredFunction {
    std::string full, doc;
    hal_step step;
    hal_row row;
    void* self;
    const void* identity;
    bool shared;
    bool required;
};

/// How many values a list has, and what an instance beyond them gets.
struct ShortList {
    std::size_t length = 0;
    std::string fallback;
};

/// What one constructor declares while it runs.
struct Construction {
    Model& model;
    const LoadRequest& request;
    Instance& instance;
    std::size_t number;                 // of this instance in the request
    std::string personality;
    // with the identity of their function
    std::vector<std::pair<std::unique_ptr<Pin>, const void*>> pins = {};
    std::vector<DeclaredFunction> functions = {};
    std::set<std::string> asked = {};    // arguments it asked for
    std::size_t list_length = 0;         // of the longest list among them
    std::string max_list = {};       // its argument
    std::map<std::string, LoadArgument::Use> uses = {};  // of those that are not common
    std::map<std::string, ShortList> lists = {};  // of arguments with a value per instance
    std::size_t declared_count = 0;  ///< instances by hal_naming::count; precedes the lists
    std::vector<std::string> texts = {};  // keeps what argument() gave
    Failure failure = {};
    bool no_memory = false;
    bool hardware_denied = false;
    std::string serial = {};             // of an instance that is named after its component
    bool whole_function_names = false;
    bool whole_pin_names = false;
    Sources* sources = nullptr;
    Diagnostics* diagnostics = nullptr;
    std::string text_name = {};
    std::string text = {};  // what it reads
    std::uint32_t text_source = 0;          // 0: no diagnostic refers to it yet
    bool said_why = false;                  // an error was
    // messages of this text; those beyond the limit are dropped
    std::size_t said = 0;
    std::deque<std::string> found = {};     // what find_text() gave
    struct NewThread {
        std::string name;
        std::int64_t period_ns;
    };
    std::vector<NewThread> threads = {};    // that a LinuxCNC module makes
    // What it has declared so far enters the model when the constructor returns, or before, when a
    // LinuxCNC module uses it by name.
    Edit* edit = nullptr;
    std::unique_ptr<Instance>* owned = nullptr;  // empty: the model has it
    std::map<const void*, LoadedFunction*> by_identity = {};
    std::vector<std::pair<LoadedFunction*, plan::Step>> extended = {};
    std::set<std::string> thread_names = {};
    std::optional<unsigned> lock = {};  // that it has set
};

/// The interface for the constructor; its callbacks write to `construction`, which must outlive it.
/// [setup]
hal_host host_for(Construction& construction);

/// Takes what the constructor has declared so far into the model. Returns false after reporting.
/// construct.cpp
bool enter_declared(Construction& construction);

/// Returns false after reporting a given argument that the constructor has not asked for.
bool all_known(const LoadedComponent& component, const LoadRequest& request,
               const std::set<std::string>& asked, Diagnostics& diagnostics);

/// The construction behind the host that a callback got.
inline Construction& construction_of(const hal_host* host) {
    return *static_cast<Construction*>(host->data);
}
/// Notes why the constructor fails, unless it is known already. Returns false.
bool refuse(Construction& construction, std::string why);
bool refuse(Construction& construction, Failure failure);

/// Runs an action for a plugin, which must not throw into it: its frames may be C. Without memory
/// it returns `otherwise`.
template <class Result, class Action>
Result guarded(Construction& c, Result otherwise, Action action) noexcept {
    try {
        return action();
    } catch (const std::bad_alloc&) {
        c.no_memory = true;
        return otherwise;
    }
}

extern const hal_naming naming_extension;  ///< names that LinuxCNC makes otherwise than COMPONENT.N
extern const hal_modules modules_extension;  ///< what only LinuxCNC's modules do
extern const hal_module_calls module_calls_extension;  ///< what they do to the machine
/// finds files the component reads, and takes what it finds wrong in them
extern const hal_texts texts_extension;

}  // namespace hal
