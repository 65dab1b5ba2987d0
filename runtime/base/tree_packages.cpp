// SPDX-License-Identifier: MIT
#include "base/tree_packages.hpp"

#include <algorithm>
#include <cctype>

#include "text/find_row.hpp"

namespace hal {

const TreePackage* find_tree_package(std::string_view name) {
    return find_row(tree_packages, name, &TreePackage::name);
}

std::string package_switch(std::string_view name) {
    std::string text = "HALCYON_PACKAGE_";
    for (const char c : name) {
        text += static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
    }
    return text;
}

std::string TreePackage::reason() const {
    const std::string who = "the package " + std::string(name);
    switch (state) {
    case PackageState::built: return {};
    case PackageState::switched_off: return who + " is switched off in this build";
    case PackageState::incomplete: break;
    }
    return who + " is left out of this build: it needs " + std::string(needs);
}

std::string TreePackage::remedy() const {
    switch (state) {
    case PackageState::built: return {};
    case PackageState::switched_off:
        return "in the source tree, type: cmake --preset release -D" + package_switch(name) +
               "=ON, then build again";
    case PackageState::incomplete: break;
    }
    const bool is_debian_package = needs.find(' ') == needs.npos;
    if (!is_debian_package) return {};
    return "type: sudo apt-get install " + std::string(needs) + ", then build again";
}

std::string TreePackage::problem() const {
    const std::string help = remedy();
    return help.empty() ? reason() : reason() + "; " + help;
}

}  // namespace hal
