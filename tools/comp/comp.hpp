// SPDX-License-Identifier: MIT
// LinuxCNC's component language: a .comp file translated to the C source of a plugin.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "text/diagnostic.hpp"
#include "text/source.hpp"

namespace hal::comp {

/// What the compiler is given.
struct Translation {
    std::string name;                       ///< of the component; the plugin's file is NAME.so
    /// option userspace: a program with user_mainloop(), not a plugin
    bool program = false;
    /// option rtapi_app no: it has its own rtapi_app_main(), as a component in C
    bool own_main = false;
    /// C source; `#line` makes the compiler's messages point into the .comp file
    std::string c;
    std::vector<std::string> compile_args;  ///< option extra_compile_args
    std::vector<std::string> link_args;     ///< option extra_link_args
};

/// Translates a text of `sources`, whose name is the file's path. Nothing after reporting errors;
/// there may be warnings all the same. Reads no file and depends on nothing but the text.
std::optional<Translation> translate(const Sources& sources, std::uint32_t source,
                                     Diagnostics& diagnostics);

/// C code that defines main(), and no rtapi_app_main().
bool is_program(std::string_view c);

}  // namespace hal::comp
