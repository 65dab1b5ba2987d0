// SPDX-License-Identifier: MIT
#include "machine/load/plugins.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <dlfcn.h>
#include <fcntl.h>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>
#include <sys/mman.h>
#include <sys/sendfile.h>
#include <unistd.h>

#include "base/tree_packages.hpp"
#include "linuxcnc/find/modules.hpp"
#include "machine/load/foreign_code.hpp"
#include "machine/load/module_library.hpp"
#include "machine/load/plugin_file.hpp"
#include "machine/load/source_tree.hpp"
#include "paths.hpp"
#include "text/folder_entries.hpp"

namespace hal {
namespace {

namespace fs = std::filesystem;

// why a description cannot be used, or empty
std::string problem_of(const hal_component& component) {
    if (component.size < offsetof(hal_component, abi_minor) + sizeof component.abi_minor) {
        return "its description is too short to be one";
    }
    if (component.abi_major != HAL_ABI_MAJOR) {
        return "it was built for version " + std::to_string(component.abi_major) +
               " of the component interface, this runtime has " + std::to_string(HAL_ABI_MAJOR);
    }
    if (component.size < sizeof component) {
        return "its description has " + std::to_string(component.size) + " bytes, at least " +
               std::to_string(sizeof component) + " are needed";
    }
    if (!component.name || !*component.name || !component.summary || !component.doc) {
        return "its description has no name, summary or doc";
    }
    if (!component.create || !component.start || !component.stop || !component.destroy) {
        return "its description leaves out create, start, stop or destroy";
    }
    const std::size_t align = component.instance_align;
    if (component.instance_size == 0 || component.instance_size > (1u << 30) || align == 0 ||
        (align & (align - 1)) != 0 || align > 4096) {
        return "the size or alignment of its instances makes no sense";
    }
    return {};
}

/// Copies the file at `path` to the end of `target`, in the kernel: plugins with debugging
/// information have tens of megabytes. Returns false when a part of it was not copied.
bool copy_file(const std::string& path, int target) {
    const int source = open(path.c_str(), O_RDONLY | O_CLOEXEC);
    if (source < 0) return false;
    constexpr std::size_t max_copied = 1u << 30;
    ssize_t copied = 0;
    do {
        copied = sendfile(target, source, nullptr, max_copied);
    } while (copied > 0 || (copied < 0 && errno == EINTR));
    close(source);
    return copied == 0;
}

// The loader knows a library by its path and would give the one that is loaded for a file that has
// since been written anew; and who writes over a mapped file pulls the code from under a running
// machine. So what is loaded is a copy in memory, each with a path of its own, under which
// debuggers find it too. nullptr when there can be none; then the file itself is loaded.
std::shared_ptr<void> open_copy(const std::string& path) {
    const std::string name = path.substr(path.rfind('/') + 1);
    const int copy = memfd_create(name.c_str(), MFD_CLOEXEC);
    if (copy < 0) return nullptr;
    char place[64];
    std::snprintf(place, sizeof place, "/proc/%d/fd/%d", static_cast<int>(getpid()), copy);
    void* const library = copy_file(path, copy) ? dlopen(place, RTLD_NOW | RTLD_LOCAL) : nullptr;
    if (!library) {
        close(copy);
        return nullptr;
    }
    return {library, [copy, path = std::string(place)](void* handle) {
        dlclose(handle);
        // Only when the library is really gone may another have the number, and with it the
        // path.
        if (!dlopen(path.c_str(), RTLD_LAZY | RTLD_NOLOAD)) {
            close(copy);
        }
    }};
}

std::string underlined(std::string_view name) {
    std::string text(name);
    std::replace(text.begin(), text.end(), '-', '_');
    return text;
}

/// Why the build left a component out, or "": a Debian package that is missing, or the switch of
/// its package of the tree. The build lists them beside the plugins.
std::string left_out_for(const std::string& name, const std::vector<std::string>& path) {
    for (const std::string& folder : path) {
        std::ifstream file(folder + "/absent");
        for (std::string component, package; file >> component >> package;) {
            if (component == name) return package;
        }
    }
    return {};
}

/// Components under the names of drivers of LinuxCNC. Other modules of LinuxCNC need its own ones
/// (hm2_pci needs hostmot2), so these are loaded where LinuxCNC is not installed, or with --native.
bool yields_to_module(std::string_view name) {
    constexpr std::string_view names[] = {"hm2_eth", "hostmot2"};
    return std::ranges::find(names, name) != std::end(names) && !find_module(name).empty();
}

void report_missing_module(std::string_view name, Span at, Diagnostics& diagnostics) {
    std::error_code none;
    const bool installed = fs::is_directory(module_folder(), none);
    const std::string quoted = "'" + std::string(name) + "'";
    const std::string folder = module_folder();
    diagnostics.error(
        "no-such-component", at,
        installed ? "LinuxCNC module " + quoted + " does not exist in " + folder
                  : quoted + " is a module of LinuxCNC, which is not installed: " + folder +
                        " does not exist",
        "",
        installed
            ? "HAL_RTMOD_DIR names another folder; for a component of ours: loadrt --native " +
                  std::string(name)
            : "sudo apt-get install linuxcnc-uspace");
}

/// What to type so that the next build has a package of the tree.
std::string switch_on(std::string_view name) {
    return TreePackage{name, "", PackageState::switched_off, ""}.remedy();
}

void report_left_out(std::string_view name, const std::string& why, Span at,
                     Diagnostics& diagnostics) {
    const std::string component = "component '" + std::string(name) + "'";
    for (const TreePackage& package : tree_packages) {
        if (package_switch(package.name) != why) continue;
        diagnostics.error("no-such-component", at,
                          component + " is in the package " + std::string(package.name) +
                              ", which is switched off in this build",
                          "", switch_on(package.name));
        return;
    }
    diagnostics.error(
        "no-such-component", at, component + " was left out of this build: it needs " + why, "",
        "sudo apt-get install " + why + ", then build again; ./hal does that by itself");
}

}  // namespace

std::string user_folder(std::string_view kind) {
    if (const char* data = std::getenv("XDG_DATA_HOME"); data && *data) {
        return std::string(data) + "/halcyon/" + std::string(kind);
    }
    if (const char* home = std::getenv("HOME"); home && *home) {
        return std::string(home) + "/.local/share/halcyon/" + std::string(kind);
    }
    return {};
}

Plugins::Plugins(std::vector<std::string> first) : path_(std::move(first)) {
    const auto add = [this](std::string folder) {
        if (!folder.empty() && std::find(path_.begin(), path_.end(), folder) == path_.end()) {
            path_.push_back(std::move(folder));
        }
    };
    if (const char* variable = std::getenv("HALCYON_PLUGIN_PATH")) {
        std::istringstream folders(variable);
        for (std::string folder; std::getline(folders, folder, ':');) {
            add(folder);
        }
    }
    add(user_folder("components"));
    // beside the program first, so that a moved tree finds its own
    std::error_code none;
    const fs::path program = fs::read_symlink("/proc/self/exe", none).parent_path();
    for (const fs::path& folder :
         {program / "../components",
          program / paths::libraries_from_programs / "halcyon/components"}) {
        if (fs::is_directory(folder, none)) {
            add(fs::canonical(folder, none).string());
        }
    }
    add(std::string(paths::build_components));
    add(std::string(paths::install_components));
}

std::string Plugins::find(std::string_view name) const {
    std::string dashed(name);
    std::replace(dashed.begin(), dashed.end(), '_', '-');
    if (name.find('/') != std::string_view::npos) {
        return {};
    }
    for (const std::string& folder : path_) {
        for (const std::string& candidate : {std::string(name), underlined(name), dashed}) {
            std::error_code none;
            if (std::string file = folder + "/" + candidate + ".so";
                fs::is_regular_file(file, none)) {
                return file;
            }
        }
    }
    return {};
}

std::optional<Plugin> Plugins::open(std::string_view name, Span at,
                                    Diagnostics& diagnostics) const {
    return open_component(*this, name, Origin::any, at, diagnostics);
}

/// Returns what to use for a component of LinuxCNC's catalogue that is missing in ours; "" for any
/// other name.
static std::string_view replacement_of(std::string_view name) {
    struct Missing {
        std::string_view name, help;
    };
    static constexpr Missing all[] = {
        {"laserpower", "use mult2 and limit1, or compile LinuxCNC's: hal compile laserpower.comp"},
        {"led_dim", "use limit1 and pwmgen, or compile LinuxCNC's: hal compile led_dim.comp"},
        {"plasmac", "for height control alone, use thc, thcud or ohmic"},
    };
    const auto* const found = std::ranges::find(all, name, &Missing::name);
    return found == std::end(all) ? "" : found->help;
}

/// Reports that no component has this name, with the reason or a similar name.
static void report_unknown(const Plugins& plugins, std::string_view name, Origin origin, Span at,
                           Diagnostics& diagnostics) {
    const std::string why = left_out_for(underlined(name), plugins.path());
    if (!why.empty()) return report_left_out(name, why, at, diagnostics);
    if (const std::string_view help = replacement_of(underlined(name)); !help.empty()) {
        diagnostics.error(
            "no-such-component", at,
            "component '" + std::string(name) + "' is one of LinuxCNC's that Halcyon does not have",
            "", std::string(help));
        return;
    }
    const std::string similar = did_you_mean(name, plugins.available());
    std::error_code none;
    const bool may_be_linuxcncs =
        origin == Origin::any && similar.empty() && !fs::is_directory(module_folder(), none);
    diagnostics.error("no-such-component", at, "unknown component '" + std::string(name) + "'",
                      similar,
                      std::string("hal doc lists all components") +
                          (may_be_linuxcncs ? "; if it is a module of LinuxCNC, which is not "
                                              "installed: sudo apt-get install linuxcnc-uspace"
                                            : ""));
}

/// Loads a plugin from its file.
static std::optional<Plugin> load_plugin(const std::string& path, Span at,
                                         Diagnostics& diagnostics) {
    const auto bad = [&](const PluginProblem& problem) {
        diagnostics.error("bad-plugin", at,
                          "'" + path + "' is not a usable component: " + problem.why, "",
                          problem.help);
        return std::nullopt;
    };
    const PluginFile file = read_plugin_file(path);
    if (!file.problem.empty()) return bad({file.problem});
    const ForeignCode loading;
    load_own_libraries(file.needed, fs::path(path).parent_path().string());
    std::shared_ptr<void> library = open_copy(path);
    if (!library) {
        void* const direct = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
        if (!direct) return bad(explain_loader_error(dlerror(), path));
        library = {direct, [](void* handle) { dlclose(handle); }};
    }
    Plugin plugin{nullptr, library, path};
    plugin.component = static_cast<const hal_component*>(dlsym(library.get(), "hal_plugin"));
    if (!plugin.component) {
        return bad(
            {"it exports no symbol hal_plugin, which HAL_COMPONENT(Type, \"name\", \"summary\") "
             "makes"});
    }
    const std::string why = problem_of(*plugin.component);
    if (!why.empty()) return bad({why});
    return plugin;
}

/// Returns what to type for a component that is listed but not there. `group` is its folder in the
/// source tree.
std::string how_to_get(const std::string& name, std::string_view group) {
    std::string text = "in the source tree, type: ./hal build " + name;
    if (const std::string package = debian_package(group); !package.empty()) {
        text += "; with Halcyon's Debian packages: sudo apt install " + package;
    }
    return text;
}

std::optional<Plugin> open_component(const Plugins& plugins, std::string_view name, Origin origin,
                                     Span at, Diagnostics& diagnostics) {
    const bool prefers_module =
        origin == Origin::linuxcnc || (origin == Origin::any && yields_to_module(name));
    std::string found = prefers_module ? "" : plugins.find(name);
    const std::string module = origin == Origin::native || !found.empty() ? "" : find_module(name);
    if (origin == Origin::linuxcnc && module.empty()) {
        report_missing_module(name, at, diagnostics);
        return std::nullopt;
    }
    const std::string own_name = underlined(name);
    const auto is_listed = [&] { return listed_components(plugins.path()).contains(own_name); };
    if (!module.empty() && (prefers_module || !is_listed())) {
        return open_module(module, at, diagnostics);
    }
    const bool unbuilt = found.empty() && is_listed();
    if (unbuilt && build_on_demand(own_name)) {
        found = plugins.find(name);
    }
    if (!found.empty()) return load_plugin(found, at, diagnostics);
    if (!unbuilt) {
        report_unknown(plugins, name, origin, at, diagnostics);
        return std::nullopt;
    }
    diagnostics.error("no-such-component", at,
                      "component '" + std::string(name) + "' is not installed", "",
                      how_to_get(own_name, listed_components(plugins.path()).at(own_name).group));
    return std::nullopt;
}

std::vector<std::string> Plugins::available() const {
    std::set<std::string> names;
    for (const std::string& folder : path_) {
        for (const fs::path& path : folder_entries(folder)) {
            if (path.extension() == ".so") {
                names.insert(path.stem().string());
            }
        }
    }
    for (const auto& [name, about] : listed_components(path_)) {
        names.insert(name);
    }
    names.insert("threads");
    return {names.begin(), names.end()};
}

}  // namespace hal
