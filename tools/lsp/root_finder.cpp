// SPDX-License-Identifier: MIT
#include "lsp/root_finder.hpp"

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <set>

#include "commands/files.hpp"
#include "run/netlist_part.hpp"

namespace hal::tools {

namespace {

namespace fs = std::filesystem;

constexpr ConfigurationKind configuration_kinds[] = {
    {".canopen", "canopen"}, {".ethercat", "ethercat"}, {".tdma", "tdma"},
    {".scocan", "scocan"},   {".modbus", "modbus"},
};

constexpr int max_depth = 16;           // of parts of parts
constexpr std::size_t max_files = 1000;  // of a folder that is searched

/// Returns the first netlist of the folder with `config=NAME`; empty: none.
std::string netlist_with_configuration(const std::string& path) {
    const std::string name = fs::path(path).filename().string();
    std::set<std::string> netlists;
    std::error_code problem;
    for (fs::directory_iterator entry(fs::path(path).parent_path(), problem), end;
         !problem && entry != end && netlists.size() < max_files; entry.increment(problem)) {
        if (entry->path().extension() == ".hal") {
            netlists.insert(entry->path().string());
        }
    }
    for (const std::string& netlist : netlists) {
        std::string text;
        std::string ignored;
        if (!read_text_file(netlist, text, ignored)) continue;
        const auto at = text.find("config=" + name);
        const bool ends =
            at != text.npos &&
            (at + 7 + name.size() == text.size() ||
             text.find_first_of(" \t\r\n\"", at + 7 + name.size()) == at + 7 + name.size());
        if (ends) return netlist;
    }
    return "";
}

/// Returns the file that reads this netlist, an INI file rather than a netlist; empty: none.
std::string reader_of(const std::string& path) {
    const std::vector<std::string> readers = files_that_read(path);
    const auto ini = std::ranges::find_if(
        readers, [](const std::string& reader) { return reader.ends_with(".ini"); });
    if (ini != readers.end()) return *ini;
    return readers.empty() ? "" : readers.front();
}

std::string outermost_reader(std::string path) {
    std::set<std::string> seen{path};
    for (int depth = 0; depth < max_depth; ++depth) {
        std::string reader = reader_of(path);
        if (reader.empty() || !seen.insert(reader).second) return path;
        path = std::move(reader);
    }
    return path;
}

}  // namespace

const ConfigurationKind* configuration_kind(const std::string& path) {
    const auto* const found =
        std::find_if(std::begin(configuration_kinds), std::end(configuration_kinds),
                     [&](const ConfigurationKind& kind) { return path.ends_with(kind.ending); });
    return found == std::end(configuration_kinds) ? nullptr : found;
}

bool names_netlists(const std::string& ini_path) {
    std::string text;
    std::string ignored;
    if (!read_text_file(ini_path, text, ignored)) return false;
    return text.find("[HAL]") != text.npos || text.find("[EMC]") != text.npos;
}

NetlistRoot find_root(const std::string& path) {
    if (!path.starts_with('/') || path.ends_with(".ini")) return {path};
    std::string netlist = path;
    if (const ConfigurationKind* const kind = configuration_kind(path)) {
        netlist = netlist_with_configuration(path);
        if (netlist.empty()) {
            return {
                path, "",
                std::string("loadrt ") + kind->component + " " + written("config=" + path) + "\n"};
        }
    }
    return {outermost_reader(netlist)};
}

}  // namespace hal::tools
