// SPDX-License-Identifier: MIT
#include "linuxcnc/binary/arguments.hpp"

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <dlfcn.h>
#include <limits>
#include <optional>
#include <string>

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

std::vector<std::string> split(const std::string& list) {
    std::vector<std::string> values;
    std::size_t from = 0;
    for (std::size_t comma; (comma = list.find(',', from)) != list.npos; from = comma + 1) {
        values.push_back(list.substr(from, comma - from));
    }
    values.push_back(list.substr(from));
    return values;
}

/// An empty text is 0, as in LinuxCNC: most modules have a default for it.
std::optional<long> parse_whole(const std::string& text) {
    char* end = nullptr;
    errno = 0;
    const long value = std::strtol(text.c_str(), &end, 0);
    if (errno != 0 || *end != '\0') return std::nullopt;
    return value;
}

bool fits_int(long value) {
    return value >= std::numeric_limits<int>::min() && value <= std::numeric_limits<int>::max();
}

/// Sets one element of the module's variable. Returns false for an invalid number.
bool set_element(void* variable, std::size_t index, char type, const std::string& text,
                 std::vector<std::unique_ptr<char[]>>& texts) {
    if (type == 's') {
        auto copy = std::make_unique<char[]>(text.size() + 1);
        std::memcpy(copy.get(), text.c_str(), text.size() + 1);
        static_cast<char**>(variable)[index] = copy.get();
        texts.push_back(std::move(copy));
        return true;
    }
    const std::optional<long> value = parse_whole(text);
    if (!value || (type != 'l' && !fits_int(*value))) return false;
    if (type == 'l') {
        static_cast<long*>(variable)[index] = *value;
    } else {
        static_cast<int*>(variable)[index] = static_cast<int>(*value);
    }
    return true;
}

}  // namespace

bool apply_arguments(const hal_host* host, void* library,
                     std::span<const halcyon_module_parameter> parameters,
                     std::vector<std::unique_ptr<char[]>>& texts) {
    for (const halcyon_module_parameter& parameter : parameters) {
        const hal_argument_decl decl{sizeof decl, 0, parameter.name, parameter.doc, nullptr};
        const char* const given = host->argument(host, &decl);
        if (!given) continue;
        void* const pointer =
            dlsym(library, (std::string("rtapi_info_address_") + parameter.name).c_str());
        if (!pointer) {
            host->fail(host, "its description of a parameter has no address");
            return false;
        }
        void* const variable = *static_cast<void**>(pointer);
        const bool array = parameter.max > 0;
        const std::vector<std::string> values =
            array ? split(given) : std::vector<std::string>{given};
        for (std::size_t i = 0; i < values.size(); ++i) {
            if (array && i >= static_cast<std::size_t>(parameter.max)) {
                return reject(host, parameter.name, given,
                              "has more than " + std::to_string(parameter.max) + " values");
            }
            if (!set_element(variable, i, parameter.type, values[i], texts)) {
                return reject(host, parameter.name, values[i], "is not a whole number");
            }
        }
    }
    return true;
}

}  // namespace hal::modules
