// SPDX-License-Identifier: MIT
// The installation of LinuxCNC that LINUXCNC_HOME names, otherwise that of the system.
#pragma once

#include <cstdlib>
#include <filesystem>
#include <string>

namespace hal {

struct LinuxcncHome {
    std::string folder;  ///< a prefix, /usr, or a source tree that was built in place
    bool in_place = false;

    std::string modules() const { return folder + (in_place ? "/rtlib" : "/lib/linuxcnc/modules"); }
};

inline LinuxcncHome linuxcnc_home() {
    const char* const named = std::getenv("LINUXCNC_HOME");
    LinuxcncHome home{named && *named ? named : "/usr"};
    std::error_code none;
    home.in_place = std::filesystem::is_directory(home.folder + "/rtlib", none);
    return home;
}

}  // namespace hal
