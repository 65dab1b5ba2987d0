// SPDX-License-Identifier: MIT
#include "journal/mapped_memory.hpp"

#include <algorithm>
#include <charconv>
#include <fstream>
#include <link.h>
#include <string_view>

namespace hal {
namespace {

constexpr std::uint64_t page = 4096;

}  // namespace

MappedMemory::MappedMemory() {
    std::ifstream maps("/proc/self/maps");
    for (std::string line; std::getline(maps, line);) {
        Range range{};
        const char* const end = line.data() + line.size();
        const auto first = std::from_chars(line.data(), end, range.begin, 16);
        if (first.ptr == end || *first.ptr != '-') continue;
        std::from_chars(first.ptr + 1, end, range.end, 16);
        ranges_.push_back(range);
    }
    dl_iterate_phdr(&MappedMemory::note, this);
}

int MappedMemory::note(dl_phdr_info* library, std::size_t /*size*/, void* self) {
    const std::string_view path = library->dlpi_name ? library->dlpi_name : "";
    Library found{std::string(path.substr(path.rfind('/') + 1)), library->dlpi_addr, {}, {}};
    Range constant{0, 0};  // what the loader has written and protected
    for (ElfW(Half) i = 0; i < library->dlpi_phnum; ++i) {
        const ElfW(Phdr)& part = library->dlpi_phdr[i];
        const std::uint64_t begin = library->dlpi_addr + part.p_vaddr;
        if (part.p_type == PT_GNU_RELRO) {
            constant = {begin, (begin + part.p_memsz + page - 1) / page * page};
        }
        if (part.p_type != PT_LOAD) continue;
        found.parts.push_back({begin, begin + part.p_memsz});
        if ((part.p_flags & PF_W) != 0) {
            found.variables.push_back(found.parts.back());
        }
    }
    for (Range& one : found.variables) {
        if (one.begin < constant.end && constant.begin < one.end) {
            one.begin = std::min(constant.end, one.end);
        }
        one.begin = (one.begin + 7) / 8 * 8;
    }
    std::erase_if(found.variables, [](const Range& one) { return one.begin >= one.end; });
    static_cast<MappedMemory*>(self)->libraries_.push_back(std::move(found));
    return 0;
}

bool MappedMemory::has(std::uint64_t address) const {
    const auto after = std::ranges::upper_bound(ranges_, address, {}, &Range::begin);
    return after != ranges_.begin() && address < std::prev(after)->end;
}

std::optional<MappedMemory::InLibrary> MappedMemory::library_of(std::uint64_t address) const {
    for (std::size_t i = 0; i < libraries_.size(); ++i) {
        for (const Range& part : libraries_[i].parts) {
            if (address >= part.begin && address < part.end) {
                return InLibrary{i, address - libraries_[i].base};
            }
        }
    }
    return std::nullopt;
}

std::vector<std::string> MappedMemory::libraries() const {
    std::vector<std::string> names;
    for (const Library& library : libraries_) {
        names.push_back(library.name);
    }
    return names;
}

std::vector<MappedMemory::Range> MappedMemory::variables_of(std::uint64_t address) const {
    const auto found = library_of(address);
    return found ? libraries_[found->library].variables : std::vector<Range>();
}

std::uint64_t MappedMemory::address_in(const std::string& library, std::uint64_t offset) const {
    const auto found = std::ranges::find(libraries_, library, &Library::name);
    return found == libraries_.end() ? 0 : found->base + offset;
}

}  // namespace hal
