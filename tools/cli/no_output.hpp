// SPDX-License-Identifier: MIT
#pragma once

#include <string_view>

#include "commands/shell.hpp"

namespace hal::tools {

/// Discards what commands print.
class NoOutput final : public Output {
public:
    void out(std::string_view) override {}
    void err(std::string_view) override {}
};

}  // namespace hal::tools
