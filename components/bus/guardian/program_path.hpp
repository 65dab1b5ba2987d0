// SPDX-License-Identifier: MIT
#pragma once

#include <dlfcn.h>

#include <filesystem>
#include <string>
#include <system_error>

namespace hal::bus {

/// Returns the path of the program of a guardian. It is in the folder `halcyon` beside the library
/// of the drivers, of which `symbol` is a function; the plugin itself may be loaded from memory, and
/// then has no folder. [setup]
inline std::string guardian_program(const void* symbol, const char* name) {
    Dl_info info{};
    dladdr(symbol, &info);
    const std::filesystem::path library = info.dli_fname != nullptr ? info.dli_fname : "";
    std::error_code none;
    return (std::filesystem::weakly_canonical(library, none).parent_path() / "halcyon" / name)
        .string();
}

}  // namespace hal::bus
