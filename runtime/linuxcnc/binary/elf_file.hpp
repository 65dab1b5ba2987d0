// SPDX-License-Identifier: MIT
// A shared object as a file: its symbols and the texts that its data refers to, without mapping or
// running it.
#pragma once

#include <cstdint>
#include <link.h>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace hal::modules {

class ElfFile {
public:
    /// Reads the file; problem() is empty if it can be used.
    explicit ElfFile(const std::string& path);

    /// Returns why the file is not a shared object for this machine; empty: it is one.
    const std::string& problem() const { return problem_; }
    /// Names that other objects must define; weak references are left out.
    const std::set<std::string>& undefined() const { return undefined_; }
    bool defines(const std::string& symbol) const { return defined_.contains(symbol); }
    /// Names and addresses of all symbols that the file exports.
    const std::map<std::string, std::uint64_t>& defined() const { return defined_; }

    /// Returns the text that the exported variable `symbol`, a `const char *`, points to; an empty
    /// string if the file does not export it.
    std::string text_of(const std::string& symbol) const;
    /// Returns the value of the exported `int` variable; `otherwise` if the file does not export
    /// it.
    std::int32_t number_of(const std::string& symbol, std::int32_t otherwise) const;

private:
    void read();
    bool check_header();
    bool read_sections();
    void read_symbols();
    void read_pointers();
    bool is_whole(const ElfW(Shdr) & section) const;
    void add_symbol(const ElfW(Sym) & symbol, const std::string& name);
    /// The addend of the relocation at a file offset, and that of one stored where it applies.
    std::uint64_t addend_at(std::uint64_t offset) const;
    std::uint64_t addend_in_place(std::uint64_t address) const;
    /// The file's bytes from a virtual address to the end of its section.
    std::string_view at_address(std::uint64_t address) const;

    std::string content_, problem_;
    std::set<std::string> undefined_;
    std::map<std::string, std::uint64_t> defined_;
    std::map<std::uint64_t, std::uint64_t> pointers_;  // address of a pointer: what it points to
    struct Section {
        std::uint64_t address, offset, size;
    };
    std::vector<ElfW(Shdr)> headers_;
    std::vector<std::uint64_t> symbol_values_;  // by index in the table of symbols
    std::map<std::uint64_t, Section> sections_;  // those with content in memory, by address
};

}  // namespace hal::modules
