// SPDX-License-Identifier: MIT
// What the program knows about where it was built and where it will be installed. The values are in
// a source that CMake writes (cmake/HalcyonBuild.cmake), so that no other source depends on where
// the build tree lies.
#pragma once

#include <string_view>

namespace hal::paths {

extern const std::string_view version;  ///< of Halcyon, "1.2.3"
/// checked out when this was built, abbreviated; "unknown" outside of a checkout
extern const std::string_view commit;
extern const std::string_view build_components;  ///< folder of the plugins in the build tree
extern const std::string_view install_components;  ///< folder of the plugins once installed
/// folder of the Python module in the build tree
extern const std::string_view build_python;
extern const std::string_view install_python;  ///< folder of the Python module once installed
/// from the folder of programs to that of libraries, once installed: `../lib`
extern const std::string_view libraries_from_programs;
extern const std::string_view includes_from_programs;  ///< the same to that of headers
extern const std::string_view build_machines;  ///< folder of the machines to start from
/// from the folder of programs to that of these machines, once installed
extern const std::string_view machines_from_programs;
/// include path of the sdk in this tree, parts separated by `:`
extern const std::string_view build_includes;
extern const std::string_view install_includes;  ///< include path of the sdk once installed

}  // namespace hal::paths
