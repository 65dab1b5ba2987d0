// SPDX-License-Identifier: MIT
// The C interface between the runtime and libhalcyon_modules.so, which runs LinuxCNC's compiled
// modules. The runtime opens that library, with its symbols visible to the modules, when the first
// module is loaded; nothing links to it.
#pragma once

#include <cstddef>
#include <cstdint>

#include "hal/abi.h"

extern "C" {

/// A module parameter; rtapi_info_* of the module.
struct halcyon_module_parameter {
    const char *name, *doc;
    char type;          ///< 'i' int, 'l' long, 's' text
    std::int32_t max;  ///< number of elements of an array; 0: a single value
};

/// A module that was opened: a description of its file. Its code is mapped by component.create and
/// unmapped by component.destroy.
struct halcyon_module {
    hal_component component;  ///< first: a component with HAL_COMPONENT_MODULE is one of these
    const char* path;
    const halcyon_module_parameter* parameters;
    std::size_t parameter_count;
};

struct halcyon_module_problem {
    char why[1024], help[256];
};

struct halcyon_modules {
    std::uint32_t size;
    /// Reads FOLDER/NAME.so. Returns nullptr after stating the problem. [setup]
    const halcyon_module* (*open)(const char* folder, const char* name,
                                  halcyon_module_problem* problem);
    /// Frees the description; its instance has been destroyed. [setup]
    void (*close)(const halcyon_module* module);
    /// Returns the name of a running module that uses symbols of this one, or nullptr; `index` 0 is
    /// the first. [setup]
    const char* (*user)(const halcyon_module* module, std::size_t index);
    /// Returns the name of the module whose task the calling thread runs, or nullptr. [any]
    const char* (*module_of_task)() noexcept;
};

/// The symbol by which the runtime finds the interface.
const halcyon_modules* halcyon_module_host();

}  // extern "C"
