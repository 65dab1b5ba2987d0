// SPDX-License-Identifier: MIT
#include "linuxcnc/find/modules.hpp"

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <system_error>

#include "linuxcnc/find/home.hpp"

namespace hal {

namespace fs = std::filesystem;

std::string module_folder() {
    const char* const folder = std::getenv("HAL_RTMOD_DIR");
    return folder && *folder ? folder : linuxcnc_home().modules();
}

std::string find_module(std::string_view name) {
    if (name.empty() || name.find('/') != name.npos) {
        return {};
    }
    std::string underlined(name), dashed(name);
    std::replace(underlined.begin(), underlined.end(), '-', '_');
    std::replace(dashed.begin(), dashed.end(), '_', '-');
    for (const std::string& candidate : {std::string(name), underlined, dashed}) {
        std::error_code none;
        if (fs::is_regular_file(module_folder() + "/" + candidate + ".so", none)) return candidate;
    }
    return {};
}

bool prefers_modules() {
    const char* const wanted = std::getenv("HALCYON_MODULES");
    return wanted && std::string_view(wanted) == "linuxcnc";
}

std::string meaningless_preference() {
    const char* const wanted = std::getenv("HALCYON_MODULES");
    return wanted && !prefers_modules() ? wanted : "";
}

Origin usual_origin(std::string_view name) {
    return prefers_modules() && !find_module(name).empty() ? Origin::linuxcnc : Origin::any;
}

}  // namespace hal
