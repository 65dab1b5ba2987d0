// SPDX-License-Identifier: MIT
#include "commands/ini_version.hpp"

#include <algorithm>

namespace hal {

bool is_linuxcnc_configuration(const Ini& ini) {
    return std::any_of(ini.entries().begin(), ini.entries().end(), [](const Ini::Entry& entry) {
        return entry.section == "EMC" || entry.section == "TASK" || entry.section == "EMCIO";
    });
}

std::string ini_version_problem(const Ini& ini) {
    const auto version = ini.get("EMC", "VERSION");
    if (version == "1.1") {
        return {};
    }
    return "[EMC]VERSION is " + version.value_or("missing") +
           ", not 1.1: the file is from an older LinuxCNC";
}

}  // namespace hal
