// SPDX-License-Identifier: MIT
// Netlists loaded without running anything: for `hal check` and `hal graph`.
#pragma once

#include <functional>
#include <string>

#include "commands/shell.hpp"
#include "machine/session.hpp"
#include "run/netlist_options.hpp"

namespace hal::tools {

/// Loads the files of `options.words` into a session that constructs components but starts none.
/// Everything printed, diagnostics included, goes to `output`; `good` is called for each file
/// without errors. Returns how many have some.
int load_offline(Shell& shell, const NetlistOptions& options, Output& output,
                 const std::function<void(const std::string& path)>& good = {});

/// Options of such a session.
SessionOptions offline();

/// Output to standard error only; what commands would print has no place here.
class ErrorsOnly final : public Output {
public:
    void out(std::string_view) override {}
    void err(std::string_view text) override;
};

}  // namespace hal::tools
