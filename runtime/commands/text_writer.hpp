// SPDX-License-Identifier: MIT
#pragma once

#include <iterator>
#include <string>
#include <utility>

#include <fmt/format.h>

namespace hal {

/// Text that grows by formatted pieces, without a string of its own for each.
struct TextWriter {
    std::string text;

    template <class... Args>
    void add(fmt::format_string<Args...> format, Args&&... args) {
        fmt::format_to(std::back_inserter(text), format, std::forward<Args>(args)...);
    }
};

}  // namespace hal
