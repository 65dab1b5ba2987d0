// SPDX-License-Identifier: MIT
// What a component declares about itself, gathered by constructing it once with default arguments:
// for manuals and completion.
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "hal/abi.h"

namespace hal {

struct Declared {
    struct Argument {
        std::string name, doc, fallback;
        bool per_instance = false;
    };
    struct Function {
        std::string name, doc;  ///< name: below the instance, or the component when shared
        bool shared = false;
    };
    struct Pin {
        std::string name, doc, unit, function;  ///< function: of the one that uses it; empty: all
        hal_type type = HAL_TYPE_BIT;
        hal_dir dir = HAL_DIR_IN;
        hal_value initial{};
        hal_value safe{};
        bool has_safe = false;
        bool finite = false;
        bool read_only = false;
    };
    std::string name, summary, doc;
    bool singleton = false;
    bool built_in = false;
    /// names of pins and functions stand for themselves, not below the instance's
    bool whole_names = false;
    unsigned default_count = 1;
    std::vector<Argument> arguments;
    std::vector<Function> functions;
    std::vector<Pin> pins;

    /// Prefix of an instance's names: "pid.N", or the name itself for a component with one
    /// instance.
    std::string instance() const;
    std::string full_name(const Function& function) const;
};

/// Runs the component's constructor and gathers its declarations. Returns false and sets `problem`
/// to the reason. `before_destruction` is called before its destructor. [setup]
bool gather(const hal_component& component, Declared& declared, std::string& problem,
            const std::function<void()>& before_destruction = {});

}  // namespace hal
