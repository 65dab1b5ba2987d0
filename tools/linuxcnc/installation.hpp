// SPDX-License-Identifier: MIT
// Where an installation of LinuxCNC has its parts, and which version it is. It is a prefix, such as
// /usr, or a source tree that was built in place, which has its programs in bin/ and scripts/ and
// its modules in rtlib/.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace hal::tools {

/// What differs between the versions. 2.10 has the I/O controller inside task, which starts before
/// the netlists, and a checker of its own.
enum class LinuxcncVersion { v2_9, v2_10 };

struct Installation {
    std::string home;  ///< the prefix, or the source tree
    std::vector<std::string> programs;  ///< folders, in the order in which they are searched
    std::string libraries;  ///< of a source tree; empty: the linker knows them
    std::string modules, python, hallib, tcl, messages, help, ncfiles, nml;
    LinuxcncVersion version = LinuxcncVersion::v2_9;
};

/// Of LINUXCNC_HOME, or /usr; the version is not asked.
Installation linuxcnc_installation();

/// Sets the version, which the installation's own program linuxcnc_var prints; without that program
/// it is 2.9. Returns the sentence why that version cannot be used, or "".
std::string ask_version(Installation&);

}  // namespace hal::tools
