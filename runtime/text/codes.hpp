// SPDX-License-Identifier: MIT
// Every diagnostic code, once: its name, which never changes, and its page for `hal explain`.
#pragma once

#include <cstddef>
#include <optional>
#include <string_view>

#include "text/code_pages.hpp"

namespace hal {

/// A code from the table; naming an unknown one does not compile.
class Code {
public:
    consteval Code(const char* name) : index_(find(name)) {}
    /// A code that is known only when the program runs.
    static std::optional<Code> named(std::string_view name) {
        for (std::size_t i = 0; i < std::size(code_pages); ++i) {
            if (name == code_pages[i].name) return Code(i);
        }
        return std::nullopt;
    }
    constexpr std::string_view name() const { return code_pages[index_].name; }
    constexpr std::string_view page() const { return code_pages[index_].page; }
    constexpr bool operator==(const Code&) const = default;

private:
    constexpr explicit Code(std::size_t index) : index_(index) {}
    static consteval std::size_t find(std::string_view name) {
        for (std::size_t i = 0; i < std::size(code_pages); ++i) {
            if (name == code_pages[i].name) return i;
        }
        throw "this code is not in code_pages.hpp";
    }
    std::size_t index_;
};

}  // namespace hal
