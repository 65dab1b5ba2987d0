// SPDX-License-Identifier: MIT
// Which addresses of this process are mapped, and which library has them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

struct dl_phdr_info;

namespace hal {

/// As it is when it is constructed. [setup]
class MappedMemory {
public:
    MappedMemory();

    bool has(std::uint64_t address) const;

    struct InLibrary {
        std::size_t library;  ///< index in libraries()
        std::uint64_t offset;
    };
    /// Returns where in a library, or in the program, the address is.
    std::optional<InLibrary> library_of(std::uint64_t address) const;
    /// Returns the names of the files, without folders; "" for the program.
    std::vector<std::string> libraries() const;
    struct Range {
        std::uint64_t begin, end;
    };
    /// Returns the variables of the library that has the address.
    std::vector<Range> variables_of(std::uint64_t address) const;
    /// Returns the address of an offset in a library; 0: it is not loaded.
    std::uint64_t address_in(const std::string& library, std::uint64_t offset) const;

private:
    struct Library {
        std::string name;
        std::uint64_t base;
        std::vector<Range> parts;
        std::vector<Range> variables;
    };
    static int note(dl_phdr_info* library, std::size_t size, void* self);

    std::vector<Range> ranges_;  // by address
    std::vector<Library> libraries_;
};

}  // namespace hal
