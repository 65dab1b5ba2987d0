// SPDX-License-Identifier: MIT
// Module parameters: what loadrt gives as NAME=VALUE goes into the module's variables.
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <dlfcn.h>
#include <limits>

#include "modules/module.hpp"

namespace hal::modules {
namespace {

bool reject(const hal_host* host, const char* name, const std::string& value,
            const std::string& why) {
    const std::string text = std::string(name) + "=" + value + " " + why;
    const hal_rejection rejection{
        sizeof rejection, HAL_SUBJECT_ARGUMENT, name, 0, 0, "", text.c_str(), ""};
    host->reject(host, &rejection);
    return false;
}

}  // namespace

bool Module::take_arguments() {
    for (const halcyon_module_parameter& parameter : described_) {
        const hal_argument_decl decl{sizeof decl, 0, parameter.name, parameter.doc, nullptr};
        const char* const given = host_->argument(host_, &decl);
        if (!given) continue;
        void* const pointer =
            dlsym(library_, (std::string("rtapi_info_address_") + parameter.name).c_str());
        if (!pointer) {
            host_->fail(host_, "its description of a parameter has no address");
            return false;
        }
        char* place = *static_cast<char**>(pointer);
        const std::string all = given;
        int index = 0;
        for (std::size_t from = 0;; ++index) {
            const bool array = parameter.most > 0;
            const auto comma = array ? all.find(',', from) : all.npos;
            const std::string text = all.substr(from, comma == all.npos ? all.npos : comma - from);
            if (array && index >= parameter.most) {
                return reject(host_, parameter.name, all,
                              "has more than " + std::to_string(parameter.most) + " values");
            }
            if (parameter.type == 's') {
                auto copy = std::make_unique<char[]>(text.size() + 1);
                std::memcpy(copy.get(), text.c_str(), text.size() + 1);
                reinterpret_cast<char**>(place)[index] = copy.get();
                strings_.push_back(std::move(copy));
            } else {
                char* end = nullptr;
                errno = 0;
                const long value = std::strtol(text.c_str(), &end, 0);
                const bool fits =
                    parameter.type == 'l' || (value >= std::numeric_limits<int>::min() &&
                                              value <= std::numeric_limits<int>::max());
                if (errno != 0 || *end != '\0' ||
                    !fits) {  // nothing is 0, as in LinuxCNC: most modules have a default for it
                    return reject(host_, parameter.name, text, "is not a whole number");
                }
                if (parameter.type == 'l') {
                    reinterpret_cast<long*>(place)[index] = value;
                } else {
                    reinterpret_cast<int*>(place)[index] = static_cast<int>(value);
                }
            }
            if (comma == all.npos) break;
            from = comma + 1;
        }
    }
    return true;
}

}  // namespace hal::modules
