// SPDX-License-Identifier: MIT
#include "machine/load/plugin_file.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <dlfcn.h>
#include <filesystem>
#include <fstream>
#include <link.h>
#include <optional>
#include <sstream>

#include "linuxcnc/binary/elf_value.hpp"
#include "paths.hpp"
#include "text/read_all.hpp"

namespace hal {
namespace {

namespace fs = std::filesystem;

std::string grouped_bytes(std::uint64_t there, std::uint64_t needed) {
    return "the file is cut short: " + std::to_string(there) + " of " + std::to_string(needed) +
           " bytes";
}

/// Returns the names of the libraries that a shared object needs (DT_NEEDED); none when the file is
/// damaged.
std::vector<std::string> names_of(std::string_view content, const std::vector<ElfW(Phdr)>& parts) {
    const auto dynamic = std::find_if(parts.begin(), parts.end(), [](const ElfW(Phdr) & part) {
        return part.p_type == PT_DYNAMIC;
    });
    if (dynamic == parts.end()) {
        return {};
    }
    std::vector<std::size_t> offsets;
    std::uint64_t text = 0;
    std::uint64_t size = 0;
    for (std::uint64_t i = 0; i < dynamic->p_filesz / sizeof(ElfW(Dyn)); ++i) {
        const auto entry = at<ElfW(Dyn)>(content, dynamic->p_offset + i * sizeof(ElfW(Dyn)));
        if (!entry || entry->d_tag == DT_NULL) break;
        if (entry->d_tag == DT_NEEDED) {
            offsets.push_back(entry->d_un.d_val);
        }
        if (entry->d_tag == DT_STRTAB) {
            text = entry->d_un.d_ptr;
        }
        if (entry->d_tag == DT_STRSZ) {
            size = entry->d_un.d_val;
        }
    }
    const auto holder = std::find_if(parts.begin(), parts.end(), [&](const ElfW(Phdr) & part) {
        return part.p_type == PT_LOAD && text >= part.p_vaddr &&
               text - part.p_vaddr < part.p_filesz;
    });
    if (holder == parts.end()) {
        return {};
    }
    const std::uint64_t begin = holder->p_offset + (text - holder->p_vaddr);
    if (begin > content.size()) {
        return {};
    }
    const std::string_view table =
        content.substr(static_cast<std::size_t>(begin), static_cast<std::size_t>(size));
    std::vector<std::string> names;
    for (const std::size_t offset : offsets) {
        if (offset < table.size()) {
            names.emplace_back(table.substr(offset, table.find('\0', offset) - offset));
        }
    }
    return names;
}

}  // namespace

PluginFile read_plugin_file(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    if (!file) {
        return {std::strerror(errno), {}};
    }
    const std::string content = read_all(file);
    const auto header = at<ElfW(Ehdr)>(content, 0);
    if (!header || std::memcmp(header->e_ident, ELFMAG, SELFMAG) != 0) {
        return {content.empty() ? "the file is empty" : "it is not a shared library", {}};
    }
    if (header->e_ident[EI_CLASS] != (sizeof(void*) == 8 ? ELFCLASS64 : ELFCLASS32) ||
        header->e_phentsize != sizeof(ElfW(Phdr))) {
        return {"it is not a shared library for this machine", {}};
    }
    std::uint64_t needed = header->e_shoff + std::uint64_t{header->e_shnum} * header->e_shentsize;
    std::vector<ElfW(Phdr)> parts;
    for (unsigned i = 0; i < header->e_phnum; ++i) {
        const auto part = at<ElfW(Phdr)>(content, header->e_phoff + i * sizeof(ElfW(Phdr)));
        if (!part) {
            return {"the file is cut short", {}};
        }
        if (part->p_type == PT_LOAD) {
            needed =
                std::max<std::uint64_t>(needed, std::uint64_t{part->p_offset} + part->p_filesz);
        }
        parts.push_back(*part);
    }
    if (needed > content.size()) {
        return {grouped_bytes(content.size(), needed), {}};
    }
    return {"", names_of(content, parts)};
}

void load_own_libraries(const std::vector<std::string>& needed, const std::string& plugin_folder) {
    std::error_code none;
    const fs::path program = fs::read_symlink("/proc/self/exe", none).parent_path(),
                   plugin(plugin_folder);
    // The build tree's bin/ and lib/, an installation's; the same seen from components/ and from
    // lib/halcyon/components/, for other programs.
    const fs::path folders[] = {program / paths::libraries_from_programs, program / "../lib",
                                plugin / "../lib", plugin / "../.."};
    for (const std::string& name : needed) {
        if (!name.starts_with("libhalcyon_") || name.find('/') != std::string::npos) continue;
        for (const fs::path& folder : folders) {  // never closed: these libraries stay
            if (const fs::path file = folder / name;
                fs::is_regular_file(file, none) &&
                dlopen(fs::weakly_canonical(file, none).c_str(), RTLD_NOW | RTLD_LOCAL)) {
                break;
            }
        }
    }
}

PluginProblem explain_loader_error(std::string message, const std::string& path) {
    if (message.starts_with(path + ": ")) {
        message.erase(0, path.size() + 2);
    }
    // cmake/HalcyonInterface.cmake
    constexpr std::string_view missing = "undefined symbol: ";
    constexpr std::string_view kind = "_interface_";
    const auto symbol = message.find(missing);

    const auto end = message.find(kind, symbol == message.npos ? 0 : symbol);
    if (symbol != message.npos && end != message.npos &&
        message.compare(symbol + missing.size(), 8, "halcyon_") == 0) {
        const auto name = symbol + missing.size();
        return {
            "it was built with another version of lib" + message.substr(name, end - name) + ".so",
            "build it again with this version of Halcyon"};
    }
    if (const auto colon = message.find(": cannot open shared object file");
        colon != std::string::npos) {
        const std::string library = message.substr(0, colon);
        if (library.starts_with("libhalcyon_")) {
            return {message,
                    "that library belongs to Halcyon and was not installed with it; install again: "
                    "cmake --install BUILD"};
        }
        return {message, "install the Debian package that has " + library +
                             "; ldd lists all libraries a component needs"};
    }
    if (symbol != message.npos) {
        return {message,
                "link the library that defines it, or rebuild the component and its libraries "
                "together"};
    }
    return {message};
}

}  // namespace hal
