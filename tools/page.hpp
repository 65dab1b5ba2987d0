// SPDX-License-Identifier: MIT
// What a component declares about itself, gathered by constructing it once with default arguments.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "hal/abi.h"

namespace hal::tools {

struct Page {
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
        hal_value initial{}, safe{};
        bool has_safe = false, finite = false;
    };
    std::string name, summary, doc;
    bool singleton = false, built_in = false;
    unsigned default_count = 1;
    std::vector<Argument> arguments;
    std::vector<Function> functions;
    std::vector<Pin> pins;

    /// Prefix of an instance's names: "pid.N", or the name itself for a component with one instance.
    std::string instance() const;
    std::string full_name(const Function& function) const;
};

/// Hosts the component's constructor. False: `problem` is a sentence that says why. [setup]
bool gather(const hal_component& component, Page& page, std::string& problem);

/// The page of `threads`, which the runtime provides itself.
Page threads_page();

std::string as_text(const Page& page);
std::string as_markdown(const Page& page);
std::string as_json(const Page& page);
std::string as_man(const Page& page);

}  // namespace hal::tools
