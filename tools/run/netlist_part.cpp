// SPDX-License-Identifier: MIT
#include "run/netlist_part.hpp"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>

namespace hal::tools {

namespace {

namespace fs = std::filesystem;

/// `source cnc/control.hal` names control.hal; a line of an INI file is `HALFILE = control.hal`.
bool names(const std::string& line, bool is_ini, const std::string& netlist) {
    std::istringstream words(line);
    std::string first;
    std::string second;
    words >> first >> second;
    if (is_ini && second == "=") {
        words >> second;
    }
    if (first != (is_ini ? "HALFILE" : "source")) return false;
    std::erase_if(second, [](char c) { return c == '"' || c == '\''; });
    return fs::path(second).filename() == netlist;
}

bool reads(const fs::path& file, const std::string& netlist) {
    std::ifstream in(file);
    const bool is_ini = file.extension() == ".ini";
    for (std::string line; std::getline(in, line);) {
        if (names(line, is_ini, netlist)) return true;
    }
    return false;
}

}  // namespace

std::vector<std::string> files_that_read(const std::string& netlist) {
    const fs::path path(netlist);
    const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
    std::vector<std::string> found;
    std::error_code problem;
    for (const fs::directory_entry& entry : fs::directory_iterator(folder, problem)) {
        const fs::path& other = entry.path();
        const bool may_read = other.extension() == ".hal" || other.extension() == ".ini";
        if (!may_read || other.filename() == path.filename()) continue;
        if (entry.is_regular_file(problem) && reads(other, path.filename())) {
            found.push_back((path.parent_path() / other.filename()).string());
        }
    }
    std::sort(found.begin(), found.end());
    return found;
}

}  // namespace hal::tools
