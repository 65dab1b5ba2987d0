// SPDX-License-Identifier: MIT
#include "commands/files.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <string_view>

#include "hal/read_file.hpp"

namespace hal {
namespace {

constexpr std::size_t max_bytes = std::size_t{1} << 30;  // places in a text are 32-bit numbers

}  // namespace

bool read_text_file(const std::string& path, std::string& text, std::string& problem,
                    bool descriptors) {
    if (read_regular_file(path, max_bytes, text, descriptors)) return true;
    problem = std::move(text);
    text.clear();
    return false;
}

std::vector<std::string> netlist_places(const std::string& name, const std::string& directory) {
    std::vector<std::string> library;
    const auto add_list = [&](const char* variable) {
        const char* const value = std::getenv(variable);
        for (std::string_view left = value ? value : ""; !left.empty();) {
            const std::string_view one = left.substr(0, left.find(':'));
            if (!one.empty()) {
                library.push_back(resolve_path(std::string(one), directory));
            }
            left.remove_prefix(std::min(left.size(), one.size() + 1));
        }
    };
    const bool only_library = name.starts_with("LIB:");
    if (!only_library) {
        add_list("HALLIB_PATH");
    }
    add_list("HALLIB_DIR");
    library.emplace_back("/usr/share/linuxcnc/hallib");
    std::vector<std::string> places;
    if (!only_library) {
        places.push_back(resolve_path(name, directory));
    }
    const std::string file = only_library ? name.substr(4) : name;
    if (only_library || !(name.starts_with('/') || name.starts_with('~'))) {
        for (const std::string& folder : library) {
            std::string place = folder + "/" + file;
            if (std::find(places.begin(), places.end(), place) == places.end()) {
                places.push_back(std::move(place));
            }
        }
    }
    return places;
}

bool read_netlist(const std::string& name, const std::string& directory, std::string& path,
                  std::string& text, std::string& problem) {
    const auto places = netlist_places(name, directory);
    for (const std::string& place : places) {
        std::string why;
        if (read_text_file(place, text, why)) {
            path = place;
            return true;
        }
        if (&place == places.data() ||
            (why != std::strerror(ENOENT) && problem == std::strerror(ENOENT))) {
            problem = why;
        }
    }
    if (name.starts_with("LIB:") && problem == std::strerror(ENOENT)) {
        problem = std::string(std::getenv("HALLIB_DIR") ? "it is not in HALLIB_DIR"
                                                        : "HALLIB_DIR is not set") +
                  " and not in /usr/share/linuxcnc/hallib";
    }
    return false;
}

std::string resolve_path(const std::string& path, const std::string& directory) {
    if (path == "~" || path.starts_with("~/")) {
        const char* const home = std::getenv("HOME");
        return (home ? home : "") + path.substr(1);
    }
    return path.starts_with('/') || directory.empty() ? path : directory + "/" + path;
}

std::string canonical_path(const std::string& path) {
    std::error_code problem;
    const auto found = std::filesystem::canonical(path, problem);
    return problem ? path : found.string();
}

std::string absolute_path(const std::string& path) {
    std::error_code problem;
    const auto found = std::filesystem::absolute(path, problem);
    return problem ? path : found.lexically_normal().string();
}

std::string folder_of(const std::string& path) {
    const auto slash = path.rfind('/');
    if (slash == path.npos) return "";
    if (slash == 0) return "/";
    return path.substr(0, slash);
}

}  // namespace hal
