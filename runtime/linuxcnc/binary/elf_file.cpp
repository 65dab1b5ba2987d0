// SPDX-License-Identifier: MIT
#include "linuxcnc/binary/elf_file.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <elf.h>
#include <fstream>
#include <iterator>
#include <optional>
#include <string_view>
#include <vector>

#include "linuxcnc/binary/elf_value.hpp"

namespace hal::modules {
namespace {

#if defined(__x86_64__)
constexpr unsigned this_machine = EM_X86_64;
#elif defined(__aarch64__)
constexpr unsigned this_machine = EM_AARCH64;
#elif defined(__arm__)
constexpr unsigned this_machine = EM_ARM;
#elif defined(__riscv)
constexpr unsigned this_machine = EM_RISCV;
#else
constexpr unsigned this_machine = EM_NONE;
#endif
constexpr bool is_64_bit = sizeof(void*) == 8;

std::string text_at(std::string_view table, std::uint64_t offset) {
    if (offset >= table.size()) {
        return {};
    }
    return std::string(table.substr(offset, table.find('\0', offset) - offset));
}

std::string machine_name(unsigned machine) {
    switch (machine) {
    case EM_X86_64: return "x86-64";
    case EM_386: return "32-bit x86";
    case EM_AARCH64: return "64-bit ARM";
    case EM_ARM: return "32-bit ARM";
    case EM_RISCV: return "RISC-V";
    default: return "machine type " + std::to_string(machine);
    }
}

std::uint64_t symbol_of(std::uint64_t info) { return is_64_bit ? info >> 32 : info >> 8; }

}  // namespace

ElfFile::ElfFile(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    if (!file) {
        problem_ = std::strerror(errno);
        return;
    }
    content_.assign(std::istreambuf_iterator<char>(file), {});
    read();
}

void ElfFile::read() {
    if (!check_header() || !read_sections()) return;
    read_symbols();
    if (symbol_values_.empty()) {
        problem_ = "it has no table of symbols";
        return;
    }
    read_pointers();
}

bool ElfFile::check_header() {
    const auto header = at<ElfW(Ehdr)>(content_, 0);
    if (content_.size() < SELFMAG || std::memcmp(content_.data(), ELFMAG, SELFMAG) != 0) {
        problem_ = content_.empty() ? "the file is empty" : "it is not a shared object";
        return false;
    }
    // e_machine is in the same place in both classes
    const auto machine = at<std::uint16_t>(content_, 18);
    const bool is_this_class = content_[EI_CLASS] == (is_64_bit ? ELFCLASS64 : ELFCLASS32);
    const bool is_this_machine = machine && (this_machine == EM_NONE || *machine == this_machine);
    if (header && is_this_class && is_this_machine) return true;
    problem_ = "it is built for " + (machine ? machine_name(*machine) : "an unknown machine") +
               ", this program for " + machine_name(this_machine);
    return false;
}

bool ElfFile::is_whole(const ElfW(Shdr) & section) const {
    if (section.sh_type == SHT_NOBITS) return true;
    return section.sh_offset <= content_.size() &&
           section.sh_size <= content_.size() - section.sh_offset;
}

bool ElfFile::read_sections() {
    const auto header = at<ElfW(Ehdr)>(content_, 0);
    for (unsigned i = 0; i < header->e_shnum; ++i) {
        const auto section =
            at<ElfW(Shdr)>(content_, header->e_shoff + std::uint64_t{i} * sizeof(ElfW(Shdr)));
        if (!section || !is_whole(*section)) {
            problem_ = "the file is cut short";
            return false;
        }
        headers_.push_back(*section);
        if ((section->sh_flags & SHF_ALLOC) && section->sh_type != SHT_NOBITS) {
            sections_[section->sh_addr] = {section->sh_addr, section->sh_offset, section->sh_size};
        }
    }
    return true;
}

void ElfFile::read_symbols() {
    for (const auto& section : headers_) {
        if (section.sh_type != SHT_DYNSYM || section.sh_link >= headers_.size()) continue;
        const auto& names = headers_[section.sh_link];
        const std::string_view table = std::string_view(content_).substr(
            names.sh_offset, names.sh_type == SHT_NOBITS ? 0 : names.sh_size);
        for (std::uint64_t i = 0; i < section.sh_size / sizeof(ElfW(Sym)); ++i) {
            const auto symbol = at<ElfW(Sym)>(content_, section.sh_offset + i * sizeof(ElfW(Sym)));
            if (!symbol) break;
            symbol_values_.push_back(symbol->st_value);
            add_symbol(*symbol, text_at(table, symbol->st_name));
        }
    }
}

void ElfFile::add_symbol(const ElfW(Sym) & symbol, const std::string& name) {
    if (name.empty()) return;
    if (symbol.st_shndx != SHN_UNDEF) {
        defined_.emplace(name, symbol.st_value);
    } else if (ELF64_ST_BIND(symbol.st_info) != STB_WEAK) {
        undefined_.insert(name);
    }
}

void ElfFile::read_pointers() {
    for (const auto& section : headers_) {
        if (section.sh_type != SHT_RELA && section.sh_type != SHT_REL) continue;
        const bool with_addend = section.sh_type == SHT_RELA;
        const std::uint64_t size = with_addend ? sizeof(ElfW(Rela)) : sizeof(ElfW(Rel));
        for (std::uint64_t i = 0; i < section.sh_size / size; ++i) {
            const std::uint64_t offset = section.sh_offset + i * size;
            const auto entry = at<ElfW(Rel)>(content_, offset);
            if (!entry) break;
            const std::uint64_t addend =
                with_addend ? addend_at(offset) : addend_in_place(entry->r_offset);
            const std::uint64_t index = symbol_of(entry->r_info);
            const std::uint64_t value = index < symbol_values_.size() ? symbol_values_[index] : 0;
            pointers_.emplace(entry->r_offset, value + addend);
        }
    }
}

std::uint64_t ElfFile::addend_at(std::uint64_t offset) const {
    const auto entry = at<ElfW(Rela)>(content_, offset);
    return entry ? static_cast<std::uint64_t>(entry->r_addend) : 0;
}

std::uint64_t ElfFile::addend_in_place(std::uint64_t address) const {
    return at<ElfW(Addr)>(at_address(address), 0).value_or(0);
}

std::string_view ElfFile::at_address(std::uint64_t address) const {
    auto section = sections_.upper_bound(address);
    if (section == sections_.begin()) {
        return {};
    }
    const Section& of = std::prev(section)->second;
    if (address - of.address >= of.size) {
        return {};
    }
    return std::string_view(content_).substr(of.offset + (address - of.address),
                                             of.size - (address - of.address));
}

std::string ElfFile::text_of(const std::string& symbol) const {
    const auto variable = defined_.find(symbol);
    if (variable == defined_.end()) {
        return {};
    }
    const auto pointer = pointers_.find(variable->second);
    return pointer == pointers_.end() ? std::string() : text_at(at_address(pointer->second), 0);
}

std::int32_t ElfFile::number_of(const std::string& symbol, std::int32_t otherwise) const {
    const auto variable = defined_.find(symbol);
    if (variable == defined_.end()) return otherwise;
    return at<std::int32_t>(at_address(variable->second), 0).value_or(otherwise);
}

}  // namespace hal::modules
