// SPDX-License-Identifier: MIT
#include "linuxcnc/find/programs.hpp"

#include <filesystem>
#include <system_error>

#include "paths.hpp"

namespace hal {

std::string linuxcnc_folder() {
    std::error_code none;
    const auto programs = std::filesystem::read_symlink("/proc/self/exe", none).parent_path();
    for (const auto& folder : {programs / "../lib/halcyon/linuxcnc",
                               programs / paths::libraries_from_programs / "halcyon/linuxcnc"}) {
        if (std::filesystem::exists(folder / "liblinuxcnchal.so.0", none)) {
            return std::filesystem::canonical(folder, none).string();
        }
    }
    return {};
}

}  // namespace hal
