// SPDX-License-Identifier: MIT
// What the runtime calls: opens modules and lists who uses whom.
#include <cstdio>
#include <exception>
#include <memory>

#include "linuxcnc/binary/module.hpp"

namespace hal::modules {
namespace {

const halcyon_module* open(const char* folder, const char* name, halcyon_module_problem* problem) {
    *problem = {};
    const auto fail = [problem](const char* why, const char* help) -> const halcyon_module* {
        std::snprintf(problem->why, sizeof problem->why, "%s", why);
        std::snprintf(problem->help, sizeof problem->help, "%s", help);
        return nullptr;
    };
    try {
        ElfFile file(std::string(folder) + "/" + name + ".so");
        if (!file.problem().empty()) {
            return fail(file.problem().c_str(),
                        "install the package linuxcnc-uspace for this machine");
        }
        for (const char* const entry : {"rtapi_app_main", "rtapi_app_exit"}) {
            if (!file.defines(entry)) {
                return fail(
                    (std::string("it is not a LinuxCNC module: it does not export ") + entry)
                        .c_str(),
                    "a component for LinuxCNC is built by halcompile; one for Halcyon by hal "
                    "compile");
            }
        }
        return &(new Module(folder, name, std::move(file)))->description();
    } catch (const std::exception& error) {
        return fail(error.what(), "");
    }
}

void close(const halcyon_module* module) {
    const Module& of = Module::of(*module);
    if (!of.broken()) {
        delete &of;  // else a task of it may still run
    }
}

const char* user(const halcyon_module* module, std::size_t index) {
    const Module& used = Module::of(*module);
    for (const Module* const other : Module::all_running()) {
        if (other != &used && other->uses(used) && index-- == 0) return other->name().c_str();
    }
    return nullptr;
}

}  // namespace
}  // namespace hal::modules

extern "C" const halcyon_modules* halcyon_module_host() {
    static constexpr halcyon_modules host{sizeof host, hal::modules::open, hal::modules::close,
                                          hal::modules::user, hal::modules::module_of_task};
    return &host;
}
