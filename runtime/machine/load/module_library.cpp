// SPDX-License-Identifier: MIT
#include "machine/load/module_library.hpp"

#include <atomic>
#include <dlfcn.h>
#include <filesystem>
#include <string>

#include "base/tree_packages.hpp"
#include "linuxcnc/binary/module_host.hpp"
#include "linuxcnc/find/home.hpp"
#include "linuxcnc/find/modules.hpp"
#include "machine/load/source_tree.hpp"
#include "paths.hpp"

namespace hal {
namespace {

namespace fs = std::filesystem;

constexpr const char* reinstall =
    "type ./hal build modules in the source tree, or reinstall Halcyon";

struct Library {
    const halcyon_modules* host = nullptr;
    std::string problem;
    std::string help;
};

// Never closed: modules are bound to it. RTLD_GLOBAL: they find its symbols in the global scope.
std::atomic<const halcyon_modules*> opened_library{nullptr};  // for signal handlers

std::string library_name() {
    return "libhalcyon_modules.so." +
           std::string(paths::version.substr(0, paths::version.rfind('.')));
}

/// Opens the library where it is beside this program, or was built or installed; no host and no
/// problem: it is nowhere.
Library find_library() {
    std::error_code none;
    const fs::path program = fs::read_symlink("/proc/self/exe", none).parent_path();
    const std::string name = library_name();
    // beside the program's own libraries, or, for other programs such as python3, where this was
    // built or installed
    const fs::path folders[] = {program / paths::libraries_from_programs, program / "../lib",
                                fs::path(paths::build_components) / "../lib",
                                fs::path(paths::install_components) / "../.."};
    for (const fs::path& folder : folders) {
        const fs::path file = folder / name;
        if (!fs::is_regular_file(file, none)) continue;
        void* const library =
            dlopen(fs::weakly_canonical(file, none).c_str(), RTLD_NOW | RTLD_GLOBAL);
        if (!library) {
            return {nullptr, dlerror(), reinstall};
        }
        const auto entry =
            reinterpret_cast<const halcyon_modules* (*)()>(dlsym(library, "halcyon_module_host"));
        if (!entry || entry()->size != sizeof(halcyon_modules)) {
            return {nullptr, file.string() + " belongs to another version of this program",
                    reinstall};
        }
        opened_library = entry();
        return {entry(), "", ""};
    }
    return {};
}

Library open_library() {
    const TreePackage* const package = find_tree_package("linuxcnc");
    if (!package->built()) return {nullptr, package->reason(), package->remedy()};
    Library found = find_library();
    const auto missing = [&] { return !found.host && found.problem.empty(); };
    if (missing() && build_on_demand("modules")) {
        found = find_library();
    }
    if (missing()) {
        found.problem =
            library_name() + ", which runs LinuxCNC's modules, is missing beside this program";
        found.help = reinstall;
    }
    return found;
}

const Library& library() {
    static const Library found = open_library();
    return found;
}

}  // namespace

std::optional<Plugin> open_module(const std::string& name, Span at, Diagnostics& diagnostics) {
    const std::string path = module_folder() + "/" + name + ".so";
    const auto bad = [&](const std::string& why, const std::string& help) {
        diagnostics.error("bad-plugin", at,
                          "'" + path + "' is not a usable LinuxCNC module: " + why, "", help);
        return std::nullopt;
    };
    if (name == "hal_lib") {
        return bad("it is LinuxCNC's own HAL, whose place this runtime takes",
                   "other modules need no loadrt hal_lib");
    }
    if (!library().host) {
        diagnostics.error("bad-plugin", at, "'" + path + "' cannot be loaded: " + library().problem,
                          "", library().help);
        return {};
    }
    halcyon_module_problem problem{};
    const halcyon_module* const module =
        library().host->open(module_folder().c_str(), name.c_str(), &problem);
    if (!module) return bad(problem.why, problem.help);
    return Plugin{&module->component,
                  {const_cast<halcyon_module*>(module),
                   [](void* m) { library().host->close(static_cast<const halcyon_module*>(m)); }},
                  path};
}

const char* module_of_task() noexcept {
    const halcyon_modules* const host = opened_library.load();
    return host ? host->module_of_task() : nullptr;
}

std::string user_of_module(const hal_component& component, std::size_t index) {
    const char* const user =
        library().host->user(reinterpret_cast<const halcyon_module*>(&component), index);
    return user ? user : "";
}

}  // namespace hal
