// SPDX-License-Identifier: MIT
// Hosting the C interface: makes instances of a component and takes their declarations into the
// model.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "hal/messages.h"
#include "hal/status.h"
#include "model/edit.hpp"
#include "model/model.hpp"
#include "text/diagnostic.hpp"

namespace hal {

class Executor;
struct Elaboration;

/// A load argument as it was given.
struct GivenArgument {
    std::string value;
    Span at;
};

struct LoadRequest {
    Span at;                                    ///< of the component's name
    std::vector<std::string> names;             ///< names=; empty: numbered
    std::int64_t count = -1;                    ///< count= or num_chan=; -1: not given
    Span count_at;
    std::vector<std::string> personalities;
    std::map<std::string, GivenArgument> arguments;
    const hal_faults* faults = nullptr;         ///< of the machine; nullptr where none runs
    /// the command's; what a LinuxCNC module does beside its instance belongs to its transaction
    Elaboration* on = nullptr;
};

/// The instances of a component once more, from another plugin and in a model beside: same names,
/// arguments and personalities.
bool construct_again(Model& beside, Edit& edit, const LoadedComponent& old, LoadedComponent& fresh,
                     Span at, const hal_faults* faults, Sources& sources, Diagnostics& diagnostics);

/// Instances of `my_comp` and their pins are named my-comp…
std::string dashed(std::string component);

/// Why a constructor or start() fails: hal_rejection with its texts copied. Empty while nothing is
/// known against the instance.
struct Failure {
    std::string text = {};
    std::string name = {};
    std::string code = {};
    std::string help = {};
    hal_subject subject = HAL_SUBJECT_INSTANCE;
    std::uint32_t begin = 0;
    std::uint32_t end = 0;
    bool empty() const { return text.empty(); }
};
/// Throws std::bad_alloc.
Failure copy_of(const hal_rejection& rejection);

/// Returns the code that the component gives; `usual` when it gives none, or one that is unknown.
Code failure_code(std::string_view given, Code usual);

/// Makes the instances of one loadrt line. False after reporting. Constructs only; start() comes
/// with the commit. `sources` takes the texts that components find something wrong in.
bool construct(Model& model, Edit& edit, LoadedComponent& component, const LoadRequest& request,
               Sources& sources, Diagnostics& diagnostics);

/// Memory that lives as long as the instance; nullptr when memory is exhausted or the request is
/// invalid.
void* allocate_for(Instance& instance, std::size_t bytes, std::size_t align) noexcept;

/// Starts one instance: it may acquire hardware. Returns why it failed, or an empty Failure.
Failure start_instance(Instance& instance, const Model& model, Executor& executor,
                       const hal_status& status, const hal_messages& messages);
/// The instance that disciplines the threads (external clock reference), or nullptr.
const Instance* clock_leader(const Model& model);
/// [setup] Not while a thread runs its functions.
void stop_instance(Instance& instance) noexcept;
void destroy_instance(Instance& instance) noexcept;

}  // namespace hal
